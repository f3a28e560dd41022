// The discrete equations on a mesh with a collapsed edge: ties, fibres, active tension, volume stiffness.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/estimator/fe/derivative_check.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tests/estimator/fe/ventricle.hpp"

namespace diastole {
namespace {

constexpr std::array<double, 2> fibres_deg{60.0, -60.0};
const std::vector<double> soft_heart{3.0, 11.09, 1.76, 10.0};

EllipsoidShape coarse() {
  EllipsoidShape shape;
  shape.elements = {5, 3, 2};
  return shape;
}

TEST(Ventricle, CavityHoldsTheCapsVolume) {
  ElasticModel model = ventricle({}, fibres_deg, soft_heart);
  // Integral of pi a^2 (1 - z^2/c^2) dz from -c to the base.
  const double a = 21.0;
  const double c = 51.0;
  const double z = 15.0;
  const double volume_mL =
      1e-3 * std::acos(-1.0) * a * a * ((z + c) - (z * z * z + c * c * c) / (3.0 * c * c));
  EXPECT_NEAR(volume_mL, 67.29, 0.01);
  EXPECT_NEAR(model.cavity_volume_mL(model.rest_state()), volume_mL, 0.02);
}

TEST(Ventricle, TangentIsTheDerivativeOfTheResidual) {
  ElasticModel model = ventricle(coarse(), fibres_deg, soft_heart, {.volume_stiffness_kPa = 7.0});
  ElasticSystem& system = model.system();
  ElasticState state = shaken(system, model.rest_state(), 0.3, 5);
  state.pressure_kPa = 2.0;
  state.fibre_tension_kPa = 12.0;
  for (unsigned seed = 1; seed < 4; ++seed) {
    const std::vector<double> step = random_step(model.dofs(), seed);
    constexpr double h = 1e-5;
    const std::vector<double> low = system.residual(system.moved(state, step, -h)).values;
    std::vector<double> slope = system.residual(system.moved(state, step, h)).values;
    for (size_t i = 0; i < slope.size(); ++i)
      slope[i] = (slope[i] - low[i]) / (2 * h);
    EXPECT_LT(largest_difference(tangent_times(system, state, step), slope), 1e-6 * largest(slope));
  }
}

TEST(Ventricle, StepsKeepToTheApexTies) {
  ElasticModel model = ventricle(coarse(), fibres_deg, soft_heart);
  const ElasticState state = shaken(model.system(), model.rest_state(), 0.3, 8);
  for (const auto& [dof, other] : model.mesh().ties().same)
    EXPECT_DOUBLE_EQ(state.position_mm[dof], state.position_mm[other]);
  for (const size_t dof : model.mesh().ties().zero)
    EXPECT_EQ(state.position_mm[dof], 0.0);
}

/// Largest force, as a fraction of the stress times the wall's area, that a homogeneous deformation leaves on
/// dofs that are not on the boundary.
double patch_fault(const EllipsoidShape& shape) {
  constexpr double c1_kPa = 6.5;
  const HermiteMesh mesh = make_ellipsoid(shape);
  HeldDofs held = hold_nothing(mesh);
  for (const auto& faces : {mesh.faces().inner, mesh.faces().outer, mesh.faces().top})
    hold_face(mesh, faces, held);
  ElasticModel model(mesh, *find_law("neo-hookean"), {.parameters = {c1_kPa}, .held = held});
  Eigen::Matrix3d f;
  f << 1.1, 0.2, 0.0, -0.1, 0.95, 0.15, 0.05, 0.0, 1.0;
  f /= std::cbrt(f.determinant());
  ElasticState state = model.rest_state();
  for (size_t start = 0; start < state.position_mm.size(); start += 3) {
    const Eigen::Vector3d moved = f * Eigen::Vector3d(&state.position_mm[start]);
    std::copy_n(moved.data(), 3, &state.position_mm[start]);
  }
  return largest(model.system().residual(state).values) /
         (2.0 * c1_kPa * shape.outer_axes_mm[0] * shape.outer_axes_mm[1]);
}

// Patch test, the apex included. What is left is the error of 4x4x4 points on curved elements, of eighth
// order; a fault of the collapsed edge would not shrink with them.
TEST(Ventricle, HomogeneousDeformationIsInEquilibriumInside) {
  EXPECT_LT(patch_fault(coarse()), 1e-6);
  EllipsoidShape fine = coarse();
  fine.elements = {10, 6, 4};
  EXPECT_LT(patch_fault(fine), patch_fault(coarse()) / 50.0);
}

TEST(Ventricle, SensitivitiesEqualFiniteDifferences) {
  ElasticModel model = ventricle(coarse(), fibres_deg, soft_heart);
  const Solution solution = model.solve(0.5);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, model.pressure_dofs());
  const std::vector<ParameterGroup> b1{whole_parameter(1)};
  const Sensitivities exact = model.sensitivities(solution.state, b1);
  const auto solved_with = [&](double value) {
    model.set_parameter(1, value);
    return model.solve(0.5, solution.state).state.position_mm;
  };
  const NodeField high = solved_with(11.09 + 1e-2);
  const NodeField low = solved_with(11.09 - 1e-2);
  NodeField slope(high.size());
  for (size_t i = 0; i < slope.size(); ++i)
    slope[i] = (high[i] - low[i]) / 2e-2;
  EXPECT_LT(largest_difference(exact.parameter[0], slope), 1e-5 * largest(slope));
}

// Fibres at +alpha and at -alpha are mirror images: the same volume, the opposite twist.
TEST(Ventricle, MirroredFibresTwistTheOtherWay) {
  const auto solved = [](double angle_deg) {
    ElasticModel model = ventricle(coarse(), {angle_deg, angle_deg}, soft_heart);
    const Solution solution = model.solve(0.4);
    EXPECT_TRUE(solution.report.converged());
    const MaterialPoint node{0, {0.0, 1.0, 0.0}};  // on y = 0
    return std::pair(model.cavity_volume_mL(solution.state),
                     model.mesh().value(solution.state.position_mm, node)[1]);
  };
  const auto [volume, twist] = solved(40.0);
  const auto [mirrored_volume, mirrored_twist] = solved(-40.0);
  EXPECT_NEAR(volume, mirrored_volume, 1e-7);
  EXPECT_NEAR(twist, -mirrored_twist, 1e-7);
  EXPECT_GT(std::abs(twist), 0.1);
}

}  // namespace
}  // namespace diastole
