#pragma once
// An air bubble in the cavity: at constant temperature its volume V falls as the absolute pressure rises (Boyle),
//
//   V(p) = V_rest p_a / (p_a + p),   p_a = 101.325 kPa
//
// so beside the gel it is a compliance of -dV/dp and takes its share of what the piston displaces.

namespace diastole::sim_rig {

struct AirBubble {
  double rest_mL = 0;  ///< at rest pressure

  static constexpr double atmospheric_kPa = 101.325;

  /// Precondition: pressure_kPa > -atmospheric_kPa.
  [[nodiscard]] double compliance_mL_per_kPa(double pressure_kPa) const {
    const double absolute_kPa = atmospheric_kPa + pressure_kPa;
    return rest_mL * atmospheric_kPa / (absolute_kPa * absolute_kPa);
  }
};

}  // namespace diastole::sim_rig
