#pragma once
// An inclusion's stiffness at the Gauss points of a mesh: there the mean over the part of the element that the point stands for, because
// an inclusion's edge is as sharp as Gauss points are apart, and what is only sampled there moves by leaps.

#include <array>
#include <vector>

#include "estimator/effects/field_model.hpp"
#include "estimator/fe/element_mechanics.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// Numbers at the Gauss points of each element.
using GaussNumbers = std::vector<std::array<double, gauss_points>>;

/// From place to place.
inline StiffnessField stiffness_field(const Inclusion& inclusion) {
  return [inclusion](const Eigen::Vector3d& X_mm) {
    return inclusion.stiffness({X_mm[0], X_mm[1], X_mm[2]});
  };
}

class InclusionStiffness {
 public:
  explicit InclusionStiffness(const HermiteMesh& mesh);

  [[nodiscard]] GaussNumbers of(const Inclusion& inclusion) const;

 private:
  /// Of the stiffness, for each Gauss point: a millimetre apart in elements of one centimetre.
  static constexpr size_t samples_a_side = 3;
  static constexpr size_t samples_a_point = samples_a_side * samples_a_side * samples_a_side;

  /// The parts of an element's volume that its Gauss points stand for, sampled evenly.
  struct Samples {
    Eigen::Vector3d middle_mm;
    double reach_mm;
    std::vector<Eigen::Vector3d> X_mm;
  };
  std::vector<Samples> samples_;
};

}  // namespace diastole
