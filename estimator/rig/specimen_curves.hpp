#pragma once
// What the rig asks of its specimen: the pressure-volume curve, and those of specimens that differ from it by one value. All
// at a modulus of 1 kPa. SpecimenFamily (estimator/model/specimen_family.hpp) solves for them.

#include "estimator/rig/specimen_curve.hpp"

namespace diastole::rig {

class SpecimenCurves {
 public:
  virtual ~SpecimenCurves() = default;

  /// Of the specimen itself.
  [[nodiscard]] virtual const SpecimenCurve& plain() const = 0;
  /// Neighbours exist for a cylinder of neo-Hookean material.
  [[nodiscard]] virtual bool has_neighbours() const = 0;

  // `low_fidelity`: how the neighbour differs is taken from the coarse mesh alone, which gives it within some percent at once.
  /// The inner radius is larger by this part, within +-0.1.
  [[nodiscard]] virtual SpecimenCurve with_inner_radius(double fraction, bool low_fidelity) const = 0;
  /// W = C1/beta (exp(beta (I1 - 3)) - 1), beta in [0, 3].
  [[nodiscard]] virtual SpecimenCurve stiffened(double beta, bool low_fidelity) const = 0;
  /// The plates hold the ends along the axis; across it they yield by this compliance times C1, mm.
  [[nodiscard]] virtual SpecimenCurve slipping(double compliance_mm, bool low_fidelity) const = 0;
};

}  // namespace diastole::rig
