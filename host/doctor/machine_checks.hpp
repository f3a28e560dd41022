#pragma once
// What a machine needs to run a real rig, looked at one by one, each with what to do about it.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"

namespace diastole {

struct MachineCheck {
  enum class State { good, lacking, not_used };
  std::string name;  ///< serial port, groups, udev rules, GPIO, instrument, time, priority, latency, disk
  State state = State::good;
  std::string found;   ///< in words
  std::string remedy;  ///< empty unless something lacks
};

/// How late a thread is woken that asked for a moment, as the daemon's threads do.
struct Latency {
  double seconds = 0;  ///< measured for
  int64_t wakes = 0;
  double median_us = 0;
  double p999_us = 0;  ///< one wake in a thousand is later
  double worst_us = 0;
  bool priority = false;  ///< with that of the instrument's thread
};

/// Wakes every millisecond for so long. `go_on` ends it earlier.
Latency measure_latency(double seconds, const std::function<bool()>& go_on);

/// A wake that is later than this costs a sample at 300 Hz.
inline constexpr double latest_wake_us = 1e6 / 300;

/// All but the latency. With a rig's file the port, lines, instrument and folder are those that it names. Nothing moves, and nothing is
/// written but a small file in the journals' folder, which is removed.
std::vector<MachineCheck> check_machine(const std::optional<RigConfig>& rig);
MachineCheck check_latency(const Latency& latency);

}  // namespace diastole
