#pragma once
// A pocket of gas at atmospheric pressure when at rest: (p_a + p) V^n = p_a V0^n.

#include <algorithm>
#include <cmath>

namespace diastole::rig {

class GasPocket {
 public:
  GasPocket(double volume_mL, double exponent, double atmosphere_kPa)
      : volume_mL_(volume_mL), exponent_(exponent), atmosphere_kPa_(atmosphere_kPa) {}

  /// Less than 0.05 mL is left out: stiffer than the hose, it would ask for far shorter steps than anybody can see.
  [[nodiscard]] bool present() const { return volume_mL_ >= 0.05; }
  /// Pressure above atmosphere when the gas is squeezed by this volume.
  [[nodiscard]] double pressure_kPa(double squeezed_mL) const {
    const double left = std::max(1.0 - squeezed_mL / volume_mL_, 0.05);
    return atmosphere_kPa_ * (std::pow(left, -exponent_) - 1.0);
  }
  [[nodiscard]] double squeezed_mL(double pressure_kPa) const {
    const double ratio = std::max(1.0 + pressure_kPa / atmosphere_kPa_, 0.05);
    return volume_mL_ * (1.0 - std::pow(ratio, -1.0 / exponent_));
  }
  [[nodiscard]] double stiffness_at_rest() const { return exponent_ * atmosphere_kPa_ / volume_mL_; }

 private:
  double volume_mL_, exponent_, atmosphere_kPa_;
};

}  // namespace diastole::rig
