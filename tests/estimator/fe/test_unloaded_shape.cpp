// The shape without load: its derivatives, the way there and back, and when there is none.

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/fe/unloaded_shape.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/mesh/placed_mesh.hpp"
#include "tests/estimator/fe/derivative_check.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tests/estimator/fe/ventricle.hpp"

namespace diastole {
namespace {

constexpr double allowed_mm = 0.02;

/// The body as it would be imaged under load, its fibres where F has carried them.
ElasticModel as_imaged(const ElasticModel& unloaded, const ElasticState& state, ElasticOptions options = {}) {
  const ElasticSystem& system = unloaded.system();
  const std::span<const double> parameters = system.parameters(0);
  options.parameters.assign(parameters.begin(), parameters.end());
  options.volume_stiffness_kPa = system.volume_stiffness_kPa();
  HermiteMesh imaged = with_reference(unloaded.mesh(), state.position_mm);
  if (system.material_axes()) {
    options.material_axes = [unloaded = unloaded.mesh(), axes = system.material_axes()](
                                const HermiteMesh& mesh, const MaterialPoint& point) {
      return carried_back(mesh.xi_gradient(mesh.reference(), point),
                          unloaded.xi_gradient(unloaded.reference(), point), axes(unloaded, point));
    };
  }
  return ElasticModel(std::move(imaged), unloaded.law(), std::move(options));
}

double farthest_mm(const HermiteMesh& mesh, const NodeField& a, const NodeField& b) {
  double farthest = 0.0;
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    const auto place = [&](const NodeField& field) {
      return Eigen::Map<const Eigen::Vector3d>(&field[dof_of(node, 0, 0)]);
    };
    farthest = std::max(farthest, (place(a) - place(b)).norm());
  }
  return farthest;
}

struct ThereAndBack {
  double loaded_mm;  ///< how far the load moves a node
  double missed_mm;  ///< how far the shape found is from the true one
  UnloadReport report;
  UnloadReturn back;
};

ThereAndBack there_and_back(ElasticModel truth, double pressure_kPa, ElasticOptions options = {}) {
  const Solution loaded = truth.solve(pressure_kPa);
  EXPECT_TRUE(loaded.report.converged()) << loaded.report.describe();
  const ElasticModel imaged = as_imaged(truth, loaded.state, std::move(options));
  InverseDesign inverse(imaged.system());
  const UnloadedShape shape = inverse.solve(pressure_kPa);
  ElasticModel unloaded = on_unloaded(imaged.system(), shape.reference_mm, {.check_stability = true});
  return {farthest_mm(truth.mesh(), loaded.state.position_mm, truth.mesh().reference()),
          farthest_mm(truth.mesh(), shape.reference_mm, truth.mesh().reference()), shape.report,
          inflate_again(unloaded, imaged.mesh(), pressure_kPa)};
}

void expect_back(const ThereAndBack& way, double moved_mm) {
  EXPECT_TRUE(way.report.converged()) << way.report.describe();
  EXPECT_GT(way.loaded_mm, moved_mm);
  EXPECT_LT(way.missed_mm, allowed_mm);
  EXPECT_TRUE(way.back.report.converged()) << way.back.report.describe();
  EXPECT_LT(way.back.farthest_mm, allowed_mm);
  EXPECT_NE(way.back.report.stable(), std::optional(false));
}

const EllipsoidShape heart{.elements = {6, 3, 1}};

TEST(UnloadedShape, AnnulusThereAndBack) { expect_back(there_and_back(gel(6.5, {6, 3, 1}), 6.0), 6.0); }

TEST(UnloadedShape, EllipsoidThereAndBack) {
  ElasticModel truth(make_ellipsoid(heart), *find_law("neo-hookean"), {.parameters = {4.0}});
  expect_back(there_and_back(std::move(truth), 2.0), 2.0);
}

TEST(UnloadedShape, VentricleWithFibresThereAndBack) {
  expect_back(there_and_back(ventricle(heart, {60.0, -60.0}, {3.0, 11.09, 1.76, 10.0}), 1.5), 3.0);
}

TEST(UnloadedShape, CompressibleThereAndBack) {
  ElasticModel truth(make_annulus(gel_shape({5, 3, 1})), *find_law("neo-hookean"),
                     {.parameters = {6.5}, .bulk_modulus_kPa = 200.0});
  expect_back(there_and_back(std::move(truth), 4.0, {.bulk_modulus_kPa = 200.0}), 3.0);
}

/// Fibres that were left where they are in space give another shape.
TEST(UnloadedShape, FibresAreCarriedWithTheMaterial) {
  ElasticModel truth = ventricle(heart, {60.0, -60.0}, {3.0, 11.09, 1.76, 10.0});
  const Solution loaded = truth.solve(1.5);
  const ElasticModel imaged = as_imaged(truth, loaded.state);
  const MaterialPoint point{4, {0.3, 0.6, 0.2}};
  const MaterialAxes back = carried_back(imaged.mesh(), imaged.system().material_axes())(truth.mesh(), point);
  const MaterialAxes there = truth.system().material_axes()(truth.mesh(), point);
  const MaterialAxes loaded_axes = imaged.system().material_axes()(imaged.mesh(), point);
  EXPECT_LT((back - there).norm(), 1e-12);
  EXPECT_GT((loaded_axes - there).norm(), 0.02);
}

TEST(UnloadedShape, DerivativeByTheReferenceIsThatOfTheResidual) {
  ElasticModel truth = ventricle({.elements = {4, 2, 1}}, {60.0, -60.0}, {3.0, 11.09, 1.76, 10.0},
                                 {.volume_stiffness_kPa = 7.0});
  const ElasticModel imaged = as_imaged(truth, truth.solve(0.6).state, {.bulk_modulus_kPa = 80.0});
  const ElasticSystem& system = imaged.system();
  const InverseDesign inverse(system);
  const ElasticState state = shaken(system, system.rest_state(), 0.2, 7);
  const NodeField change = system.node_field(random_step(system.equations().unknowns(), 3));
  std::vector<double> exact(system.equations().unknowns(), 0.0);
  inverse.add_reference_residual(system.mesh().reference(), state, {&change, 1}, exact);
  constexpr double h_mm = 1e-5;
  const auto residual_at = [&](double fraction) {
    NodeField reference = system.mesh().reference();
    add_scaled(reference, fraction, change);
    const ElasticModel body = on_unloaded(system, reference);
    return body.system().residual(state).values;
  };
  const std::vector<double> above = residual_at(h_mm), below = residual_at(-h_mm);
  double largest = 0.0, fault = 0.0;
  for (size_t n = 0; n < exact.size(); ++n) {
    const double difference = (above[n] - below[n]) / (2 * h_mm);
    largest = std::max(largest, std::abs(difference));
    fault = std::max(fault, std::abs(difference - exact[n]));
  }
  EXPECT_LT(fault, 1e-6 * largest);
}

TEST(UnloadedShape, DerivativesAreThoseOfTheShape) {
  ElasticModel truth = gel(6.5, {4, 2, 1});
  ElasticModel imaged = as_imaged(truth, truth.solve(4.0).state);
  InverseDesign inverse(imaged.system());
  const UnloadedShape shape = inverse.solve(4.0);
  const std::array groups{whole_parameter(0)};
  const InverseDesign::Derivatives exact = inverse.derivatives(shape, groups);
  const auto fault = [&](const NodeField& above, const NodeField& below, double h,
                         const NodeField& expected) {
    double largest = 0.0, worst = 0.0;
    for (size_t i = 0; i < expected.size(); ++i) {
      largest = std::max(largest, std::abs(expected[i]));
      worst = std::max(worst, std::abs((above[i] - below[i]) / (2 * h) - expected[i]));
    }
    return worst / largest;
  };
  constexpr double h = 1e-4;
  const NodeField more_P = inverse.solve(4.0 + h, &shape).reference_mm;
  const NodeField less_P = inverse.solve(4.0 - h, &shape).reference_mm;
  EXPECT_LT(fault(more_P, less_P, h, exact.by_pressure), 1e-5);
  imaged.set_parameter(0, 6.5 + h);
  const NodeField more_C1 = inverse.solve(4.0, &shape).reference_mm;
  imaged.set_parameter(0, 6.5 - h);
  const NodeField less_C1 = inverse.solve(4.0, &shape).reference_mm;
  EXPECT_LT(fault(more_C1, less_C1, h, exact.by_parameter[0]), 1e-5);
}

/// A thick soft ring at far too great a pressure: what was imaged cannot be an equilibrium of it.
TEST(UnloadedShape, SaysWhenThereIsNone) {
  const ElasticModel imaged = gel(1.0, {5, 2, 1});
  const UnloadedShape shape = InverseDesign(imaged.system()).solve(60.0);
  EXPECT_FALSE(shape.report.converged());
  EXPECT_LT(shape.report.reached_pressure_kPa, 60.0);
  EXPECT_GT(shape.report.reached_pressure_kPa, 0.0);
  EXPECT_EQ(shape.report.reason, SolveReason::inverted_element);
  ASSERT_TRUE(shape.report.folded);
  EXPECT_TRUE(shape.report.describe().starts_with("no shape without load: an element folds after "))
      << shape.report.describe();
}

TEST(UnloadedShape, LoadStepsAreLimitedAndNotIterations) {
  const ElasticModel imaged = gel(1.0, {5, 2, 1});
  InverseDesign inverse(imaged.system());
  const UnloadedShape whole = inverse.solve(60.0, nullptr, {.load_step_limit = 30});
  EXPECT_GT(whole.report.iterations, 30U);
  EXPECT_EQ(whole.report.reason, SolveReason::inverted_element);
  const UnloadedShape cut = inverse.solve(60.0, nullptr, {.load_step_limit = 3});
  EXPECT_EQ(cut.report.reason, SolveReason::out_of_steps);
  EXPECT_LE(cut.report.load_steps, 3U);
}

}  // namespace
}  // namespace diastole
