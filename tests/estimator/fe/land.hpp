#pragma once
// The three problems of S. Land et al., "Verification of cardiac mechanics software: benchmark problems and
// solutions for testing active and passive material behaviour", Proc. R. Soc. A 471 (2015) 20150641, on any
// mesh. Reference values are converged ones of independent discretisations (docs/verification.md).

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/mesh/block.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "tests/estimator/fe/ventricle.hpp"

namespace diastole {

/// Problem 1: where the point (10, 0.5, 1) of the bent beam is.
inline Eigen::Vector3d land_beam_tip_mm(std::array<size_t, 3> elements) {
  HermiteMesh mesh = make_block({{10.0, 1.0, 1.0}, elements, 0.8});
  ElasticOptions options{.parameters = {2.0, 8.0, 2.0, 4.0}, .held = hold_nothing(mesh)};
  hold_face(mesh, mesh.faces().left, *options.held);
  ElasticModel model(std::move(mesh), *find_law("guccione"), options);
  const Solution solution = model.solve(0.004);
  EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, model.pressure_dofs());
  const PointLocator locator(model.mesh(), model.mesh().reference());
  return model.mesh().value(solution.state.position_mm, locator.find({10.0, 0.5, 1.0})->point);
}

struct LandVentricle {
  ElasticModel model;
  ElasticState state;
  EllipsoidShape shape;

  /// Height of the apex at depth t (0 endocardium, 1 epicardium).
  [[nodiscard]] double apex_mm(double t) const {
    const double layers = static_cast<double>(shape.elements[2]);
    const size_t layer = std::min(static_cast<size_t>(t * layers), shape.elements[2] - 1);
    const size_t element = layer * shape.elements[0] * shape.elements[1];
    return model.mesh().value(state.position_mm,
                              {element, {0.0, 0.0, t * layers - static_cast<double>(layer)}})[2];
  }
  /// Rotation about z of the mid-wall at a fraction of the meridian angle from apex to base.
  [[nodiscard]] double twist_deg(double fraction) const {
    const double a = 0.5 * (shape.inner_axes_mm[0] + shape.outer_axes_mm[0]);
    const double c = 0.5 * (shape.inner_axes_mm[1] + shape.outer_axes_mm[1]);
    const double psi = fraction * std::acos(-shape.base_z_mm / c);
    const PointLocator locator(model.mesh(), model.mesh().reference());
    const auto found = locator.find({a * std::sin(psi), 0.0, -c * std::cos(psi)});
    const Eigen::Vector3d x = model.mesh().value(state.position_mm, found->point);
    return std::atan2(x[1], x[0]) * 180.0 / std::acos(-1.0);
  }
  [[nodiscard]] double cavity_mL() const { return model.cavity_volume_mL(state); }
};

inline LandVentricle land_ventricle(const EllipsoidShape& shape, std::vector<double> guccione,
                                    const Load& load) {
  constexpr double volume_stiffness_kPa = 20.0;
  ElasticModel model =
      ventricle(shape, {90.0, -90.0}, std::move(guccione), {.volume_stiffness_kPa = volume_stiffness_kPa});
  Solution solution = model.solve(load, model.rest_state());
  EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, model.pressure_dofs());
  return {std::move(model), std::move(solution.state), shape};
}

/// Problem 2: isotropic, inflated by 10 kPa.
inline LandVentricle land_inflated(std::array<size_t, 3> elements) {
  return land_ventricle(land_ellipsoid(elements), {10.0, 1.0, 1.0, 1.0}, {.pressure_kPa = 10.0});
}

/// Problem 3: fibres +90 to -90, 15 kPa and an active tension of 60 kPa.
inline LandVentricle land_contracted(std::array<size_t, 3> elements) {
  return land_ventricle(land_ellipsoid(elements), {2.0, 8.0, 2.0, 4.0},
                        {.pressure_kPa = 15.0, .fibre_tension_kPa = 60.0});
}

}  // namespace diastole
