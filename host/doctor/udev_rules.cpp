#include "host/doctor/udev_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

std::string given() { return fmt::format("GROUP=\"{}\", MODE=\"0660\"", device_group); }

/// First line of an attribute; empty if there is none.
std::string attribute(const fs::path& device, const char* name) {
  std::ifstream file(device / name);
  std::string line;
  std::getline(file, line);
  return line;
}

/// Whether it may stand in a rule as it is: a device states what it likes, and rules have quotes, patterns and commands.
bool plain(const std::string& text) {
  return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, [](char letter) {
    return std::isalnum(static_cast<unsigned char>(letter)) != 0 || letter == '-' || letter == '_' ||
           letter == '.' || letter == ':';
  });
}

/// The USB device that `device` is a part of; empty if of none.
fs::path usb_device(fs::path device, const fs::path& sys) {
  std::error_code ignored;
  for (; device.has_relative_path() && device != sys; device = device.parent_path())
    if (fs::exists(device / "idVendor", ignored)) return device;
  return {};
}

std::string rule_for_line(const std::string& port, const fs::path& sys, const fs::path& dev) {
  std::error_code lost;
  const fs::path device = fs::canonical(port.starts_with('/') ? fs::path(port) : dev / port, lost);
  if (lost)
    throw HardwareError(port, "is not there",
                        "Plug the controller in, or name its port in [controller] port.");
  const std::string name = device.filename().string();
  const fs::path real_sys = fs::canonical(sys, lost);
  const fs::path node = fs::canonical(sys / "class/tty" / name / "device", lost);
  const fs::path usb = lost ? fs::path() : usb_device(node, real_sys);
  if (usb.empty()) return fmt::format(R"(SUBSYSTEM=="tty", KERNEL=="{}", {})", name, given());
  const std::string vendor = attribute(usb, "idVendor"), product = attribute(usb, "idProduct"),
                    serial = attribute(usb, "serial");
  if (plain(serial))
    return fmt::format(
        R"(SUBSYSTEM=="tty", SUBSYSTEMS=="usb", ATTRS{{idVendor}}=="{}", ATTRS{{idProduct}}=="{}", ATTRS{{serial}}=="{}", {}, SYMLINK+="diastole-controller")",
        vendor, product, serial, given());
  return fmt::format(
      R"(SUBSYSTEM=="tty", KERNELS=="{}", ATTRS{{idVendor}}=="{}", ATTRS{{idProduct}}=="{}", {}, SYMLINK+="diastole-controller")",
      usb.filename().string(), vendor, product, given());
}

std::string rule_for_chip(const std::string& chip, const fs::path& sys) {
  const std::string name = fs::path(chip).filename().string();
  std::error_code lost;
  const fs::path real_sys = fs::canonical(sys, lost);
  const fs::path node = fs::canonical(sys / "bus/gpio/devices" / name, lost);
  if (lost)
    throw HardwareError(chip, "is not there", "Name another in [gpio] chip; `ls /dev/gpiochip*` lists them.");
  // Chips are numbered as they are found; where one sits does not change.
  const std::string place = "/" + fs::relative(node.parent_path(), real_sys).string();
  return fmt::format(R"(SUBSYSTEM=="gpio", KERNEL=="gpiochip*", DEVPATH=="{}/gpiochip*", {})", place,
                     given());
}

}  // namespace

std::vector<std::string> udev_rules(const RigConfig& rig, const fs::path& sys, const fs::path& dev) {
  std::vector<std::string> rules{rule_for_line(rig.controller.port, sys, dev)};
  if (rig.gpio) rules.push_back(rule_for_chip(rig.gpio->chip, sys));
  return rules;
}

}  // namespace diastole
