#pragma once
// The gel phantom's pressure-volume curve: an incompressible neo-Hookean annulus (W = C1 (I1 - 3)), inner and
// outer radius 22.5 and 50 mm, height 85 mm, end faces bonded to plates.
//
// Its shape is the infinite cylinder's in plane strain,
//   p / C1 = 2 [ ln(B a / (A b)) + (c/2) (1/a^2 - 1/b^2) ],  c = a^2 - A^2 = b^2 - B^2 = dV / (pi H),
// times a stiffening by the bonded ends that grows with inflation. That factor is the parabola through the
// three converged finite-element points 0.35227 at 23.883 mL, 0.5 at 35.761 mL and 0.92308 at 78.351 mL.

namespace diastole::sim_rig {

/// How a gel may differ from its description (flaws.hpp).
struct GelShape {
  double inner_radius_part = 0;
  double stiffening =
      0;  ///< the plane-strain pressure is then an integral over the wall; the ends' factor stays
  double bond_left = 1;
};

class GelAnnulus {
 public:
  /// Precondition: C1_kPa > 0.
  explicit GelAnnulus(double C1_kPa, const GelShape& shape = {}) : C1_kPa_(C1_kPa), shape_(shape) {}

  /// Cavity pressure at a volume change of `inflation_mL` from the unloaded cavity (135.2 mL).
  /// Precondition: -100 mL < inflation_mL < 200 mL (beyond the fitted points, 0 to 78 mL, it is an
  /// extrapolation).
  [[nodiscard]] double pressure_kPa(double inflation_mL) const;
  /// dp/dV in kPa/mL.
  [[nodiscard]] double stiffness_kPa_per_mL(double inflation_mL) const;
  /// Elastic energy stored, kPa mL (= mJ): the curve's integral from 0.
  [[nodiscard]] double energy_mJ(double inflation_mL) const;

 private:
  double C1_kPa_;
  GelShape shape_;
};

}  // namespace diastole::sim_rig
