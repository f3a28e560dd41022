#pragma once
// The gel in its chamber: the annulus's curve, with whatever it remembers.
//
//   p = s p_e(V) - sum g_i L_i + k V,  dL_i/dt = (s p_e - L_i) / tau_i
//
// s: warming and softening. Without flaws p = p_e(V).

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/sim_rig/plant/flaws.hpp"
#include "tools/sim_rig/plant/gel_annulus.hpp"

namespace diastole::sim_rig {

class Specimen {
 public:
  Specimen(double C1_kPa, const SpecimenFlaws& flaws, const OwnLaws& own = {})
      : flaws_(flaws),
        own_(own),
        gel_(C1_kPa, {flaws.inner_radius_part, flaws.stiffening, flaws.bond_left}) {}

  [[nodiscard]] double pressure_kPa(double inflation_mL) const {
    double pressure = scale_ * gel_.pressure_kPa(inflation_mL) + flaws_.chamber_kPa_mL * inflation_mL;
    for (size_t i = 0; i < relaxed_kPa_.size(); ++i)
      pressure -= flaws_.relaxing[i] * relaxed_kPa_[i];
    return own_.specimen_kPa ? own_.specimen_kPa(pressure, inflation_mL, since_first_cycle_s_) : pressure;
  }
  /// dp/dV at once, kPa/mL.
  [[nodiscard]] double stiffness_kPa_per_mL(double inflation_mL) const {
    constexpr double small_mL = 1e-3;
    if (own_.specimen_kPa)
      return (pressure_kPa(inflation_mL + small_mL) - pressure_kPa(inflation_mL - small_mL)) / (2 * small_mL);
    return scale_ * gel_.stiffness_kPa_per_mL(inflation_mL) + flaws_.chamber_kPa_mL;
  }

  void begin_cycle() { ++cycle_; }
  /// A step has passed and ended at this volume.
  void pass(double inflation_mL, double step_s) {
    const double elastic_kPa = scale_ * gel_.pressure_kPa(inflation_mL);
    for (size_t i = 0; i < relaxed_kPa_.size(); ++i)
      relaxed_kPa_[i] += (elastic_kPa - relaxed_kPa_[i]) * -std::expm1(-step_s / flaws_.relaxing_s[i]);
    largest_mL_ = std::max(largest_mL_, inflation_mL);
    if (cycle_ == 0) return;
    since_first_cycle_s_ += step_s;
    const double softened = flaws_.softening * -std::expm1(-(cycle_ - 1) / flaws_.softening_cycles) *
                            -std::expm1(-largest_mL_ / flaws_.softening_V0_mL);
    const double warmed = flaws_.warming * -std::expm1(-since_first_cycle_s_ / flaws_.warming_s);
    scale_ = (1 - softened) * (1 + warmed);
  }

 private:
  SpecimenFlaws flaws_;
  OwnLaws own_;
  GelAnnulus gel_;
  int cycle_ = 0;
  double since_first_cycle_s_ = 0;
  double largest_mL_ = 0;
  double scale_ = 1;
  std::array<double, 3> relaxed_kPa_{};
};

}  // namespace diastole::sim_rig
