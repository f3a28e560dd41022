#pragma once
// The bad line as a program: a serial port on one side, a pseudo-terminal on the other, faults between them.

#include <cstdint>
#include <optional>
#include <string>

#include "tests/link_faults/line_faults.hpp"

namespace diastole::link_faults {

struct ProxyOptions {
  std::string port;  ///< where the controller is: a device, or the link of sim_board or sim_rig
  std::string link;  ///< symbolic link to the pseudo-terminal that the host opens
  unsigned baud = 460'800;
  std::uint64_t seed = 1;
  FaultRates to_controller, to_host;
  std::optional<double> seconds;
};

struct ProxyReport {
  FaultCounts to_controller, to_host;
  double wall_s = 0;
};

/// Carries bytes until the time is over or `stop` (a descriptor) becomes readable. Prints one JSON line with the
/// path that the host opens. Throws InputError and HardwareError; a port that vanishes is a HardwareError, after
/// the host's side has been hung up too.
ProxyReport run_proxy(const ProxyOptions& options, int stop);

/// The report as a table for people.
std::string to_text(const ProxyReport& report);

}  // namespace diastole::link_faults
