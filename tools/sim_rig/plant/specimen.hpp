#pragma once
// The gel in its chamber: the annulus's curve, with whatever it remembers.
//
//   p = s p_e(V) - sum g_i L_i + k V,  dL_i/dt = (s p_e - L_i) / tau_i
//
// s: warming and softening. Without flaws p = p_e(V).

#include <array>

#include "tools/sim_rig/plant/flaws.hpp"
#include "tools/sim_rig/plant/gel_annulus.hpp"

namespace diastole::sim_rig {

class Specimen {
 public:
  Specimen(double C1_kPa, const SpecimenFlaws& flaws)
      : flaws_(flaws), gel_(C1_kPa, {flaws.inner_radius_part, flaws.stiffening, flaws.bond_left}) {}

  [[nodiscard]] double pressure_kPa(double inflation_mL) const;
  /// dp/dV at once, kPa/mL.
  [[nodiscard]] double stiffness_kPa_per_mL(double inflation_mL) const;

  void begin_cycle() { ++cycle_; }
  /// A step has passed and ended at this volume.
  void pass(double inflation_mL, double step_s);

 private:
  SpecimenFlaws flaws_;
  GelAnnulus gel_;
  int cycle_ = 0;
  double since_first_cycle_s_ = 0;
  double largest_mL_ = 0;
  double scale_ = 1;
  std::array<double, 3> relaxed_kPa_{};
};

}  // namespace diastole::sim_rig
