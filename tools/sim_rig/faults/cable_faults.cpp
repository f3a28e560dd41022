// Faults of the cables to the host and to the scanner.

#include "tools/sim_rig/faults/fault_kind.hpp"

namespace diastole::sim_rig::faults {

void serial_hangup(RigInTrouble& rig, std::optional<double> value) {
  value ? rig.cables.line.hang_up() : rig.cables.line.plug_in();
}

void serial_silence(RigInTrouble& rig, std::optional<double> value) {
  rig.cables.to_host = rig.cables.from_host = !value;
}

void serial_deaf(RigInTrouble& rig, std::optional<double> value) { rig.cables.from_host = !value; }

void gate_lost(RigInTrouble& rig, std::optional<double> value) { rig.cables.to_scanner = !value; }

}  // namespace diastole::sim_rig::faults
