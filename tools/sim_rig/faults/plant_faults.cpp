// Faults of piston, hose, phantom and transducer; their physics is in tools/sim_rig/plant.

#include "tools/sim_rig/faults/fault_kind.hpp"

namespace diastole::sim_rig::faults {

void leak_at_cannula(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.plant().leak({.conductance_mL_s_kPa = value.value_or(0)});
}

void air_bubble(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.plant().admit({.rest_mL = value.value_or(0)});
}

void blocked_hose(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.plant().block({.open_share = value.value_or(1)});
}

void step_loss(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.carriage().slip().lose(value.value_or(0));
}

void slipping_coupling(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.carriage().slip().slip_above(value);
}

void sensor_offset(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.plant().cavity_sensor().falsify(value.value_or(0), 0);
}

void sensor_drift(RigInTrouble& rig, std::optional<double> value) {
  rig.rig.plant().cavity_sensor().falsify(0, value.value_or(0));
}

}  // namespace diastole::sim_rig::faults
