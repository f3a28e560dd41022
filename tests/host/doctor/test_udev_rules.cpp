// Rules give a rig's own devices to the daemon's group, by what nothing else has, and let a device write no rules.

#include "host/doctor/udev_rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// /sys and /dev with an adapter and a GPIO chip, as Linux shows them.
class UdevRules : public testing::Test {
 protected:
  UdevRules() {
    const fs::path usb = scratch / "sys/devices/pci0000:00/0000:00:14.0/usb1/1-2";
    write(usb / "idVendor", "0403");
    write(usb / "idProduct", "6001");
    const fs::path tty = usb / "1-2:1.0/ttyUSB7/tty/ttyUSB7";
    fs::create_directories(tty);
    fs::create_directory_symlink(usb / "1-2:1.0/ttyUSB7", tty / "device");
    link(tty, "sys/class/tty/ttyUSB7");
    const fs::path onboard = scratch / "sys/devices/pnp0/00:04/tty/ttyS0";
    fs::create_directories(onboard);
    fs::create_directory_symlink(scratch / "sys/devices/pnp0/00:04", onboard / "device");
    link(onboard, "sys/class/tty/ttyS0");
    const fs::path chip = scratch / "sys/devices/platform/soc/fe200000.gpio/gpiochip3";
    fs::create_directories(chip);
    link(chip, "sys/bus/gpio/devices/gpiochip3");
    for (const char* node : {"ttyUSB7", "ttyS0", "gpiochip3"})
      write(scratch / "dev" / node, "");
    fs::create_directories(scratch / "dev/serial/by-id");
    fs::create_symlink(scratch / "dev/ttyUSB7", scratch / "dev/serial/by-id/the-adapter");
  }
  void serial_number(const std::string& text) {
    write(scratch / "sys/devices/pci0000:00/0000:00:14.0/usb1/1-2/serial", text);
  }
  std::vector<std::string> rules(const std::string& port) {
    rig.controller.port = (scratch / "dev" / port).string();
    return udev_rules(rig, scratch / "sys", scratch / "dev");
  }

  const Scratch scratch{"udev"};
  RigConfig rig = read_rig(fs::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");

 private:
  static void write(const fs::path& file, const std::string& text) {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text << '\n';
  }
  void link(const fs::path& to, const std::string& name) {
    fs::create_directories((scratch / name).parent_path());
    fs::create_directory_symlink(to, scratch / name);
  }
};

TEST_F(UdevRules, TellTheControllersAdapterByItsSerialNumber) {
  serial_number("A50285BI");
  const std::string expected =
      R"(SUBSYSTEM=="tty", SUBSYSTEMS=="usb", ATTRS{idVendor}=="0403", ATTRS{idProduct}=="6001", ATTRS{serial}=="A50285BI", )"
      R"(GROUP="diastole-devices", MODE="0660", SYMLINK+="diastole-controller")";
  EXPECT_THAT(rules("ttyUSB7"), testing::ElementsAre(expected));
  EXPECT_THAT(rules("serial/by-id/the-adapter"), testing::ElementsAre(expected));
}

TEST_F(UdevRules, TellAnAdapterWithoutOneByItsSocket) {
  const std::vector<std::string> found = rules("ttyUSB7");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], AllOf(HasSubstr(R"(KERNELS=="1-2")"), HasSubstr(R"(ATTRS{idVendor}=="0403")"),
                              Not(HasSubstr("serial"))));
}

TEST_F(UdevRules, TakeNoTextFromADeviceThatCouldBeARule) {
  for (const std::string& text : std::vector<std::string>{R"(1", RUN+="/bin/sh)", "A*", "A 1", "A\t1", "{x}",
                                                          "$env", std::string(65, 'A')}) {
    serial_number(text);
    EXPECT_THAT(rules("ttyUSB7").at(0), AllOf(HasSubstr(R"(KERNELS=="1-2")"), Not(HasSubstr(text)))) << text;
  }
}

TEST_F(UdevRules, TellALineOfTheBoardByItsNameAndAChipByItsPlace) {
  rig.gpio = GpioConfig{.chip = "gpiochip3"};
  EXPECT_THAT(
      rules("ttyS0"),
      testing::ElementsAre(
          R"(SUBSYSTEM=="tty", KERNEL=="ttyS0", GROUP="diastole-devices", MODE="0660")",
          R"(SUBSYSTEM=="gpio", KERNEL=="gpiochip*", DEVPATH=="/devices/platform/soc/fe200000.gpio/gpiochip*", )"
          R"(GROUP="diastole-devices", MODE="0660")"));
}

TEST_F(UdevRules, AreNotMadeForWhatIsNotThere) {
  EXPECT_THAT(message_of<HardwareError>([&] { (void)rules("ttyUSB9"); }), HasSubstr("ttyUSB9"));
  rig.gpio = GpioConfig{.chip = "gpiochip9"};
  EXPECT_THAT(message_of<HardwareError>([&] { (void)rules("ttyS0"); }), HasSubstr("gpiochip9"));
}

}  // namespace
}  // namespace diastole
