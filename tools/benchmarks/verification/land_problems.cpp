#include "tools/benchmarks/verification/land_problems.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "estimator/mesh/block.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

LandVentricle solved(const EllipsoidShape& shape, std::vector<double> guccione, const Load& load) {
  // Beside the Lagrange pressure: the solution does not know it, Newton's method does.
  ElasticOptions options{.parameters = std::move(guccione), .volume_stiffness_kPa = 20.0};
  options.material_axes = material_axes_of(ellipsoid_fibres(shape, 90.0, -90.0));
  options.solve.check_stability = true;
  ElasticModel model(make_ellipsoid(shape), *find_law("guccione"), std::move(options));
  Solution solution = model.solve(load, model.rest_state());
  return {std::move(model), std::move(solution), shape};
}

}  // namespace

LandBeam land_beam(std::array<size_t, 3> elements, double grading) {
  HermiteMesh mesh = make_block({{10.0, 1.0, 1.0}, elements, grading});
  ElasticOptions options{.parameters = {2.0, 8.0, 2.0, 4.0}, .held = hold_nothing(mesh)};
  hold_face(mesh, mesh.faces().left, *options.held);
  ElasticModel model(std::move(mesh), *find_law("guccione"), options);
  LandBeam beam{model.solve(0.004), {}, model.dofs(), model.pressure_dofs()};
  const PointLocator locator(model.mesh(), model.mesh().reference());
  beam.tip_mm = model.mesh().value(beam.solution.state.position_mm, locator.find({10.0, 0.5, 1.0})->point);
  return beam;
}

EllipsoidShape land_ellipsoid(std::array<size_t, 3> elements, double base_grading) {
  EllipsoidShape shape;
  shape.inner_axes_mm = {7.0, 17.0};
  shape.outer_axes_mm = {10.0, 20.0};
  shape.base_z_mm = 5.0;
  shape.base_grading = base_grading;
  shape.elements = elements;
  return shape;
}

double LandVentricle::apex_mm(double t) const {
  const double layers = static_cast<double>(shape.elements[2]);
  const size_t layer = std::min(static_cast<size_t>(t * layers), shape.elements[2] - 1);
  const size_t element = layer * shape.elements[0] * shape.elements[1];
  return model.mesh().value(solution.state.position_mm,
                            {element, {0.0, 0.0, t * layers - static_cast<double>(layer)}})[2];
}

double LandVentricle::twist_deg(double fraction) const {
  const double a = 0.5 * (shape.inner_axes_mm[0] + shape.outer_axes_mm[0]);
  const double c = 0.5 * (shape.inner_axes_mm[1] + shape.outer_axes_mm[1]);
  const double psi = fraction * std::acos(-shape.base_z_mm / c);
  const PointLocator locator(model.mesh(), model.mesh().reference());
  const auto found = locator.find({a * std::sin(psi), 0.0, -c * std::cos(psi)});
  const Eigen::Vector3d x = model.mesh().value(solution.state.position_mm, found->point);
  return std::atan2(x[1], x[0]) * 180.0 / std::numbers::pi;
}

LandVentricle land_inflated(const EllipsoidShape& shape) {
  return solved(shape, {10.0, 1.0, 1.0, 1.0}, {.pressure_kPa = 10.0});
}

LandVentricle land_contracted(const EllipsoidShape& shape) {
  return solved(shape, {2.0, 8.0, 2.0, 4.0}, {.pressure_kPa = 15.0, .fibre_tension_kPa = 60.0});
}

}  // namespace diastole
