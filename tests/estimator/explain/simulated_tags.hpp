#pragma once
// Tag points of a specimen with hidden field effects, made as those of tests/data/fe: six short-axis slices
// with stripes along (1, +-1, 0), six long-axis ones every 30 degrees with stripes along e +- z, 5 mm apart with random phase,
// slices fixed in space, errors along the normal, pressures with errors. Equilibria are solved on finer meshes than explain
// uses, in every frame.

#include <array>

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

/// What is in no library; it grows with the load.
struct OutsideMotion {
  double twist_deg = 0.0;              ///< of the top plate against the bottom one, at the highest pressure
  std::array<double, 2> shift_mm{};    ///< of the top plate
  double body_force_kPa_per_mm = 0.0;  ///< along x; water weighs 0.0098
};

struct SimulatedTags {
  FieldModel truth = {};
  OutsideMotion outside = {};
  double C1_kPa = 8.0;
  bool C1_known = false;  ///< by a test right to 0.7 %
  double highest_kPa = 3.0;
  double sigma_mm = 0.13;
  size_t tags = 2600;  ///< a frame
  unsigned seed = 1;
};

/// Frame 0 and five loaded ones. The base is the paper's gel. Throws std::runtime_error without an equilibrium.
FieldCase simulated_tags(const SimulatedTags& wanted);

}  // namespace diastole::explain
