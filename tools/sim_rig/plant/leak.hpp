#pragma once
// A leak at the cavity, through a cannula that does not seal: outflow in proportion to the pressure (a narrow
// slit, laminar). Under suction it draws in as much.

namespace diastole::sim_rig {

struct Leak {
  double conductance_mL_s_kPa = 0;

  [[nodiscard]] double flow_mL_s(double pressure_kPa) const { return conductance_mL_s_kPa * pressure_kPa; }
};

}  // namespace diastole::sim_rig
