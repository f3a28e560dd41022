#pragma once
// The three problems of S. Land et al., "Verification of cardiac mechanics software: benchmark problems and
// solutions for testing active and passive material behaviour", Proc. R. Soc. A 471 (2015) 20150641, on any
// mesh: Guccione's law, incompressible, follower pressure.

#include <array>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/mesh/ellipsoid.hpp"

namespace diastole {

/// Problem 1: a beam of 10 x 1 x 1 mm clamped at one end, fibres along it, pushed by 0.004 kPa from one side.
struct LandBeam {
  Solution solution;
  Eigen::Vector3d tip_mm;  ///< where the point (10, 0.5, 1) is
  size_t unknowns = 0;
  size_t pressure_unknowns = 0;
};
/// `grading` towards the clamped face (estimator/mesh/block.hpp).
LandBeam land_beam(std::array<size_t, 3> elements, double grading = 0.8);

/// The body of problems 2 and 3.
EllipsoidShape land_ellipsoid(std::array<size_t, 3> elements, double base_grading = 0.8);

struct LandVentricle {
  ElasticModel model;
  Solution solution;
  EllipsoidShape shape;

  /// Height of the apex at depth t (0 endocardium, 1 epicardium).
  [[nodiscard]] double apex_mm(double t) const;
  /// Rotation about z of the mid-wall at a fraction of the meridian angle from apex to base.
  [[nodiscard]] double twist_deg(double fraction) const;
  [[nodiscard]] double cavity_mL() const { return model.cavity_volume_mL(solution.state); }
};

/// Problem 2: isotropic, inflated by 10 kPa.
LandVentricle land_inflated(const EllipsoidShape& shape);

/// Problem 3: fibres +90 to -90 degrees, 15 kPa and an active tension of 60 kPa.
LandVentricle land_contracted(const EllipsoidShape& shape);

}  // namespace diastole
