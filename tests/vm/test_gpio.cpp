// The gating line and the emergency stop through libgpiod and the kernel's gpio-sim.

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "host/gpio/gate_check.hpp"
#include "host/gpio/gate_inputs.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::vm {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

std::string text_of(const fs::path& path) {
  std::ifstream stream(path);
  std::string text;
  stream >> text;
  return text;
}

void put(const fs::path& path, const std::string& text) {
  std::ofstream stream(path);
  ASSERT_TRUE(stream << text << std::flush) << path;
}

/// A chip of eight lines whose levels are set from here.
class SimulatedChip {
 public:
  SimulatedChip() {
    fs::create_directory(config_);
    fs::create_directory(config_ / "bank");
    put(config_ / "bank/num_lines", "8");
    put(config_ / "live", "1");
    const std::string chip = text_of(config_ / "bank/chip_name");
    lines_ = fs::path("/sys/devices/platform") / text_of(config_ / "dev_name") / chip;
    name = chip;
    for (int i = 0; i < 200 && !fs::exists("/dev/" + chip); ++i)
      std::this_thread::sleep_for(10ms);
  }
  ~SimulatedChip() {
    std::ofstream(config_ / "live") << "0" << std::flush;
    fs::remove(config_ / "bank");
    fs::remove(config_);
  }
  SimulatedChip(const SimulatedChip&) = delete;
  SimulatedChip& operator=(const SimulatedChip&) = delete;

  void set(unsigned line, bool high) const {
    put(lines_ / ("sim_gpio" + std::to_string(line)) / "pull", high ? "pull-up" : "pull-down");
  }
  void pulse(unsigned line) const {
    set(line, true);
    set(line, false);
  }

  std::string name;

 private:
  fs::path config_ = "/sys/kernel/config/gpio-sim/rig";
  fs::path lines_;
};

uint64_t now_ns() { return static_cast<uint64_t>(std::chrono::steady_clock::now().time_since_epoch() / 1ns); }

/// Takes until `count` pulses are there, or none has come for two seconds.
GateReading take_pulses(GateInputs& inputs, size_t count) {
  GateReading all;
  for (int idle = 0; idle < 200 && all.pulse_ns.size() < count; ++idle) {
    const GateReading reading = inputs.take();
    if (!reading.pulse_ns.empty()) idle = 0;
    all.pulse_ns.insert(all.pulse_ns.end(), reading.pulse_ns.begin(), reading.pulse_ns.end());
    all.may_have_lost = all.may_have_lost || reading.may_have_lost;
    std::this_thread::sleep_for(10ms);
  }
  return all;
}

TEST(Gpio, AThousandPulsesAreCountedInOrderWithTheKernelsTimes) {
  const SimulatedChip chip;
  const auto inputs = open_gpio({.chip = chip.name, .gate_line = 3, .estop_line = 5});
  const uint64_t begun_ns = now_ns();
  std::vector<uint64_t> times;
  for (int burst = 0; burst < 100; ++burst) {  // no more at a time than the kernel keeps
    for (int i = 0; i < 10; ++i)
      chip.pulse(3);
    const GateReading reading = take_pulses(*inputs, 10);
    times.insert(times.end(), reading.pulse_ns.begin(), reading.pulse_ns.end());
  }
  ASSERT_EQ(times.size(), 1000U);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_GE(times.front(), begun_ns);
  EXPECT_LE(times.back(), now_ns());
}

TEST(Gpio, AFloodIsCountedOrSaidToBeIncomplete) {
  const SimulatedChip chip;
  const auto inputs = open_gpio({.chip = chip.name, .gate_line = 3});
  for (int i = 0; i < 1000; ++i)
    chip.pulse(3);
  const GateReading reading = take_pulses(*inputs, 1000);
  EXPECT_LE(reading.pulse_ns.size(), 1000U);
  EXPECT_TRUE(reading.pulse_ns.size() == 1000 || reading.may_have_lost);
}

TEST(Gpio, TheEmergencyStopIsSeenByEdgeAndLevel) {
  const SimulatedChip chip;
  chip.set(5, true);  // normally closed: high is released
  const auto inputs = open_gpio({.chip = chip.name, .estop_line = 5, .estop_active_low = true});
  EXPECT_FALSE(inputs->estop_pressed());
  EXPECT_FALSE(inputs->counts_pulses());
  chip.set(5, false);
  std::this_thread::sleep_for(200ms);
  EXPECT_TRUE(inputs->estop_pressed());
  chip.set(5, true);
  std::this_thread::sleep_for(200ms);
  EXPECT_FALSE(inputs->estop_pressed());
  const GateReading reading = inputs->take();
  ASSERT_EQ(reading.estop_changes.size(), 2U);
  EXPECT_TRUE(reading.estop_changes[0].pressed);
  EXPECT_TRUE(reading.estop_changes[0].edge_seen);
  EXPECT_FALSE(reading.estop_changes[1].pressed);
  EXPECT_LT(reading.estop_changes[0].host_ns, reading.estop_changes[1].host_ns);
}

TEST(Gpio, OnePulseTooManyIsFoundByTheCheck) {
  const SimulatedChip chip;
  const auto inputs = open_gpio({.chip = chip.name, .gate_line = 3});
  GateCheck check(*inputs);
  for (int i = 0; i < 11; ++i)
    chip.pulse(3);
  std::this_thread::sleep_for(200ms);
  const auto remarks = check.close(now_ns(), {10, false}, 10);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_EQ(remarks[0].level, "error");
  EXPECT_THAT(remarks[0].text, testing::HasSubstr("11 pulses"));
}

TEST(Gpio, LinesThatAreAbsentOrInUseAreHardwareErrors) {
  const SimulatedChip chip;
  EXPECT_THROW(open_gpio({.chip = "gpiochip77", .gate_line = 0}), HardwareError);
  EXPECT_THROW(open_gpio({.chip = chip.name, .gate_line = 99}), HardwareError);
  const auto inputs = open_gpio({.chip = chip.name, .gate_line = 1});
  EXPECT_THROW(open_gpio({.chip = chip.name, .gate_line = 1}), HardwareError);
}

}  // namespace
}  // namespace diastole::vm
