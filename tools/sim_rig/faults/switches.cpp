// Faults of the controller's inputs and supply.

#include "tools/sim_rig/faults/fault_kind.hpp"

namespace diastole::sim_rig::faults {

void estop(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.controller().hold_switch(sim_controller::Switch::estop, value.has_value());
}

void far_limit(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.controller().hold_switch(sim_controller::Switch::far_limit, value.has_value());
}

void home_limit(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.controller().hold_switch(sim_controller::Switch::home, value.has_value());
}

void power_cut(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.controller().set_power(!value.has_value());
}

}  // namespace diastole::sim_rig::faults
