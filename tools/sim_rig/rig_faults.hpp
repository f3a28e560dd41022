#pragma once
// What is made to go wrong in a simulated rig, as given on the command line (times in seconds of the rig's
// clock):
//
//   serial-hangup@T        the controller's line is unplugged for good
//   daq-stall@T+D          the instrument answers nothing for D seconds
//   daq-drop@T+D           the instrument closes its connections, and takes none for D seconds
//   daq-delay@T+D/L        for D seconds the instrument's answers come L seconds late
//
// With "ttl+T" in place of T, an instrument's fault counts from the first rising edge of the TTL, however long
// starting and homing took: daq-stall@ttl+1+0.3.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tools/sim_daq/daq_faults.hpp"

namespace diastole::sim_rig {

struct RigFaults {
  uint64_t serial_hangup_ns = std::numeric_limits<uint64_t>::max();
  sim_daq::DaqFaults daq{};
  sim_daq::DaqFaults daq_from_ttl{};  ///< times since the first rising edge
};

/// Throws InputError that names the text and the form expected.
RigFaults parse_rig_faults(const std::vector<std::string>& texts);

}  // namespace diastole::sim_rig
