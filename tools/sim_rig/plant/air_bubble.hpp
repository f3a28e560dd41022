#pragma once
// An air bubble: its volume V falls as the absolute pressure rises, at constant temperature (Boyle, n = 1) or faster
// than heat goes through its surface (n up to 1.4),
//
//   V(p) = V_rest (p_a / (p_a + p))^(1/n),   p_a = 101.325 kPa
//
// so beside the gel it is a compliance of -dV/dp and takes its share of what the piston displaces.

#include <cmath>

namespace diastole::sim_rig {

struct AirBubble {
  double rest_mL = 0;  ///< at rest pressure
  double exponent = 1;

  static constexpr double atmospheric_kPa = 101.325;

  /// Precondition: pressure_kPa > -atmospheric_kPa, or no bubble.
  [[nodiscard]] double compliance_mL_per_kPa(double pressure_kPa) const {
    if (rest_mL == 0) return 0;
    const double absolute_kPa = atmospheric_kPa + pressure_kPa;
    if (exponent == 1) return rest_mL * atmospheric_kPa / (absolute_kPa * absolute_kPa);
    return rest_mL / exponent * std::pow(atmospheric_kPa / absolute_kPa, 1 / exponent) / absolute_kPa;
  }
};

}  // namespace diastole::sim_rig
