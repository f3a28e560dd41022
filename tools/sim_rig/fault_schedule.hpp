#pragma once
// When which fault is switched on and off, as --fault says:
//
//   NAME@WHEN[/VALUE][:off@WHEN]   or   NAME@WHEN+LENGTH[/VALUE]
//   WHEN = [ttl+|run+]SECONDS[s]   on the rig's clock; or after the first rising edge of the TTL; or after the start
//                                  of run, the zero of a run file's times
//
//   leak@12.5s:off@20s      estop@run+3.2      daq-stall@ttl+1+0.3      daq-delay@5+2/0.05

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/sim_rig/faults.hpp"

namespace diastole::sim_rig {

enum class Origin : uint8_t { rig, ttl, run };

struct Moment {
  Origin origin = Origin::rig;
  uint64_t after_ns = 0;
  uint32_t run = 0;  ///< of ttl and run: in which of the rig's runs, from 1; 0: in the latest
};

struct FaultSwitch {
  const FaultKind* kind = nullptr;
  Moment when;
  std::optional<double> value;  ///< switched on with it; none: switched off
};

/// Throws InputError that names the text and the form expected.
std::vector<FaultSwitch> parse_faults(const std::vector<std::string>& texts);
/// "run+3.2s". Throws InputError.
Moment parse_moment(const std::string& text);

}  // namespace diastole::sim_rig
