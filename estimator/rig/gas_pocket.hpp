#pragma once
// A pocket of gas at atmospheric pressure when at rest: (p_a + p) V^n = p_a V0^n.

#include <algorithm>
#include <cmath>

namespace diastole::rig {

class GasPocket {
 public:
  GasPocket(double volume_mL, double exponent, double atmosphere_kPa)
      : volume_mL_(volume_mL), exponent_(exponent), atmosphere_kPa_(atmosphere_kPa) {}

  [[nodiscard]] bool present() const { return volume_mL_ > 0.0; }
  /// The volume by which it is squeezed at this pressure above atmosphere.
  [[nodiscard]] double squeezed_mL(double pressure_kPa) const {
    const double ratio = std::max(1.0 + pressure_kPa / atmosphere_kPa_, least_left);
    return volume_mL_ * (1.0 - std::pow(ratio, -1.0 / exponent_));
  }
  [[nodiscard]] double compliance_at_rest() const { return volume_mL_ / (exponent_ * atmosphere_kPa_); }
  /// The pressure when the gas and a spring of this compliance, one behind the other, are squeezed by this volume.
  [[nodiscard]] double pressure_behind_kPa(double squeezed_mL, double compliance_mL_per_kPa) const {
    // Newton's method for the part of the volume that is left, from where both are linear: what is off falls with it and is
    // convex, so that after the first step all go one way.
    const double linear = compliance_at_rest() / (compliance_at_rest() + compliance_mL_per_kPa);
    double left = std::max(1.0 - linear * squeezed_mL / volume_mL_, least_left);
    double pressure = above_kPa(left);
    for (int step = 0; step < 20; ++step) {
      const double off = volume_mL_ * (1.0 - left) + compliance_mL_per_kPa * pressure - squeezed_mL;
      const double slope =
          volume_mL_ + compliance_mL_per_kPa * exponent_ * (atmosphere_kPa_ + pressure) / left;
      const double next = std::max(left + off / slope, least_left);
      const bool is_close = std::abs(next - left) < 1e-12;
      left = next;
      pressure = above_kPa(left);
      if (is_close) break;
    }
    return pressure;
  }

 private:
  static constexpr double least_left = 0.05;

  [[nodiscard]] double above_kPa(double left) const {
    return atmosphere_kPa_ * (std::pow(left, -exponent_) - 1.0);
  }

  double volume_mL_, exponent_, atmosphere_kPa_;
};

}  // namespace diastole::rig
