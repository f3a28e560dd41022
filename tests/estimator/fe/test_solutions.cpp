// Equilibria: against closed forms, conservation laws, symmetry, and finite differences of the solutions
// themselves.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "estimator/mesh/point_locator.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

TEST(PatchTest, UniaxialStretchIsExactOnADistortedMesh) {
  constexpr double stretch = 1.2;
  constexpr double c1_kPa = 6.5;
  ElasticModel model = gel(c1_kPa, {5, 3, 2});
  ElasticState exact = model.rest_state();
  for (size_t start = 0; start < exact.position_mm.size(); start += 3) {
    exact.position_mm[start] /= std::sqrt(stretch);
    exact.position_mm[start + 1] /= std::sqrt(stretch);
    exact.position_mm[start + 2] *= stretch;
  }
  const ElasticState start = shaken(model.system(), exact, 0.3, 2);  // held dofs keep the stretched plates
  const Solution solution = model.solve(0.0, start);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_LT(largest_difference(solution.state.position_mm, exact.position_mm), 1e-7);
  for (const double p : solution.state.lagrange_pressure_kPa)
    EXPECT_NEAR(p, 2.0 * c1_kPa / stretch, 1e-7);
}

/// Pressure that moves the inner wall of an infinitely long (plane-strain) neo-Hookean cylinder by u.
double cylinder_pressure_kPa(double u, double c1_kPa) {
  constexpr double inner = 22.5;
  constexpr double outer = 50.0;
  const double a = inner + u;
  const double c = a * a - inner * inner;
  const double b = std::sqrt(outer * outer + c);
  return 2.0 * c1_kPa * (std::log(outer * a / (inner * b)) + 0.5 * c * (1.0 / (a * a) - 1.0 / (b * b)));
}

TEST(PlaneStrainCylinder, MatchesTheClosedFormAndConvergesWithLayers) {
  constexpr double wall_mm = 6.0;
  constexpr double c1_kPa = 6.5;
  std::vector<double> errors;
  for (const size_t layers : {1U, 2U, 4U}) {
    ElasticModel model = plane_strain_slice(c1_kPa, layers);
    const Solution solution = model.solve(cylinder_pressure_kPa(wall_mm, c1_kPa));
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
    const Eigen::Vector3d wall = model.mesh().value(solution.state.position_mm, {1, {0.0, 0.5, 0.0}});
    errors.push_back(std::abs(wall.head<2>().norm() - 22.5 - wall_mm) / wall_mm);
  }
  EXPECT_LT(errors[0], 1e-2);
  EXPECT_LT(errors[1], errors[0] / 3.0);
  EXPECT_LT(errors[2], errors[1] / 3.0);
  EXPECT_LT(errors[2], 3e-4);
}

TEST(Symmetry, SolutionHasThatOfTheProblem) {
  ElasticModel model = gel(6.5);
  const Solution solution = model.solve(6.0);
  ASSERT_TRUE(solution.report.converged());
  const auto at = [&](size_t element, const Xi& xi) {
    return model.mesh().value(solution.state.position_mm, {element, xi});
  };
  for (size_t level = 0; level < 2; ++level) {
    const Eigen::Vector3d reference = at(8 * level, {0.3, 0.2, 0.7});
    for (size_t turn = 0; turn < 8; ++turn) {
      const double angle = static_cast<double>(turn) * std::acos(-1.0) / 4.0;
      const Eigen::Vector3d turned = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) * reference;
      EXPECT_TRUE(at(8 * level + turn, {0.3, 0.2, 0.7}).isApprox(turned, 1e-9));
      const Eigen::Vector3d mirrored(turned[0], turned[1], -turned[2]);
      EXPECT_TRUE(at(8 * (3 - level) + turn, {0.3, 0.8, 0.7}).isApprox(mirrored, 1e-9));
    }
  }
}

TEST(EnergyBalance, WorkOfThePressureIsStored) {
  ElasticModel model = gel(6.5);
  constexpr double load_kPa = 6.0;
  // Work = P V(P) - integral of V dP, by five Gauss points.
  const LineRule<5> rule = line_rule_5();
  ElasticState state = model.rest_state();
  const double rest_mL = model.cavity_volume_mL(state);
  double complementary_mJ = 0.0;
  for (size_t q = 0; q < 5; ++q) {
    const Solution solution = model.solve(load_kPa * rule.place[q], state);
    ASSERT_TRUE(solution.report.converged());
    state = solution.state;
    complementary_mJ += load_kPa * rule.weight[q] * (model.cavity_volume_mL(state) - rest_mL);
  }
  const Solution loaded = model.solve(load_kPa, state);
  const double work_mJ = load_kPa * (model.cavity_volume_mL(loaded.state) - rest_mL) - complementary_mJ;
  EXPECT_NEAR(model.stored_energy_mJ(loaded.state), work_mJ, 1e-5 * work_mJ);
  EXPECT_GT(work_mJ, 100.0);
}

TEST(Sensitivities, EqualFiniteDifferencesOfResolvedStates) {
  ElasticModel model = gel(6.5);
  const Solution solution = model.solve(4.0);
  ASSERT_TRUE(solution.report.converged());
  const Sensitivities exact =
      model.sensitivities(solution.state, std::vector<ParameterGroup>{whole_parameter(0), {0, {9}}});
  ASSERT_EQ(exact.parameter.size(), 2U);
  EXPECT_EQ(exact.negative_pivots, model.pressure_dofs());
  const auto difference = [&](const NodeField& high, const NodeField& low, double step) {
    NodeField slope(high.size());
    for (size_t i = 0; i < slope.size(); ++i)
      slope[i] = (high[i] - low[i]) / (2.0 * step);
    return slope;
  };
  constexpr double step = 1e-3;
  const auto solved_with = [&](double whole, double element) {
    model.set_parameter(0, 6.5 + whole);
    model.set_element_parameter(0, 9, 6.5 + whole + element);
    return model.solve(4.0, solution.state).state.position_mm;
  };
  const NodeField whole = difference(solved_with(step, 0.0), solved_with(-step, 0.0), step);
  const NodeField element = difference(solved_with(0.0, step), solved_with(0.0, -step), step);
  model.set_parameter(0, 6.5);
  const NodeField pressure = difference(model.solve(4.0 + step, solution.state).state.position_mm,
                                        model.solve(4.0 - step, solution.state).state.position_mm, step);
  EXPECT_LT(largest_difference(exact.parameter[0], whole), 1e-5 * largest(whole));
  EXPECT_LT(largest_difference(exact.parameter[1], element), 1e-5 * largest(element));
  EXPECT_LT(largest_difference(exact.pressure, pressure), 1e-5 * largest(pressure));
}

TEST(Sensitivities, ElementsAddUpToTheWhole) {
  ElasticModel model = gel(8.8);
  const Solution solution = model.solve(3.1);
  std::vector<ParameterGroup> groups = each_element(0, model.mesh().element_count());
  groups.push_back(whole_parameter(0));
  const Sensitivities by = model.sensitivities(solution.state, groups);
  NodeField sum(by.pressure.size(), 0.0);
  NodeField summed(by.pressure.size(), 0.0);  // without signs: rounding is a part of this
  for (size_t e = 0; e < model.mesh().element_count(); ++e) {
    for (size_t i = 0; i < sum.size(); ++i) {
      sum[i] += by.parameter[e][i];
      summed[i] += std::abs(by.parameter[e][i]);
    }
  }
  EXPECT_LT(largest_difference(sum, by.parameter.back()), 1e-10 * largest(summed));
}

TEST(Solve, WarmStartReachesTheSameState) {
  ElasticModel model = gel(6.5);
  const Solution cold = model.solve(6.0);
  const Solution warm = model.solve(6.0, model.solve(5.5).state);
  ASSERT_TRUE(cold.report.converged() && warm.report.converged());
  EXPECT_LT(largest_difference(cold.state.position_mm, warm.state.position_mm), 1e-7);
  EXPECT_EQ(model.solve(6.0, cold.state).report.factorisations, 1U);
}

// The tangent at rest, kept and updated, leads to an inner wall that is a third farther out.
TEST(Solve, NeedsOneTangentForTheGelsWholeLoad) {
  ElasticModel model = gel(6.5);
  const SolveReport report = model.solve(6.0).report;
  EXPECT_EQ(report.factorisations, 1U);
  EXPECT_LE(report.newton_iterations, 16U);
}

TEST(Solve, IsTheSameForAnyNumberOfThreads) {
  std::vector<NodeField> positions;
  for (const size_t threads : {1U, 2U, 4U}) {
    ElasticModel model = gel(6.5, {8, 4, 1}, {.threads = threads});
    positions.push_back(model.solve(6.0).state.position_mm);
  }
  EXPECT_LT(largest_difference(positions[0], positions[1]), 1e-10);
  EXPECT_LT(largest_difference(positions[0], positions[2]), 1e-10);
  ElasticModel again = gel(6.5, {8, 4, 1}, {.threads = 4});
  EXPECT_EQ(again.solve(6.0).state.position_mm, positions[2]);
}

TEST(Solve, AnisotropicLawWithFullTangentConverges) {
  ElasticModel model(make_annulus(gel_shape({8, 4, 1})), fibre_exponential(),
                     {.parameters = {10.0, 2.0}, .solve = {.check_stability = true}});
  const Solution solution = model.solve(3.0);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
}

TEST(Inertia, OneNegativePivotAPressureAtRestAndUnderLoad) {
  ElasticModel model = gel(6.5);
  EXPECT_EQ(model.pressure_dofs(), 8 * model.mesh().element_count());
  EXPECT_EQ(model.sensitivities(model.rest_state(), {}).negative_pivots, model.pressure_dofs());
  EXPECT_EQ(model.solve(6.0).report.negative_pivots, model.pressure_dofs());
}

// Why the pressure is discontinuous: docs/decisions/0010-hermite-meshes-with-a-discontinuous-pressure.md.
TEST(Inertia, ContinuousPressureHasSpuriousNegativePivotsOnTheUniformMesh) {
  AnnulusShape shape = gel_shape({8, 4, 1});
  shape.plate_grading = shape.wall_grading = 0.0;
  ElasticModel model(make_annulus(shape), *find_law("neo-hookean"),
                     {.parameters = {6.5}, .pressure_space = PressureSpace::continuous});
  EXPECT_GT(model.sensitivities(model.rest_state(), {}).negative_pivots, model.pressure_dofs());
}

TEST(Failure, StrainBeyondALawsPoleIsReportedWithItsElement) {
  std::vector<double> values;
  for (const LawParameter& parameter : find_law("pole-zero")->parameters())
    values.push_back(parameter.typical);
  ElasticModel model(make_annulus(gel_shape({6, 2, 1})), *find_law("pole-zero"), {.parameters = values});
  ElasticState beyond = model.rest_state();
  for (size_t start = 0; start < beyond.position_mm.size(); start += 3)
    beyond.position_mm[start + 2] *= 2.0;  // a strain of 1.5, where the largest limit is 0.943
  const SolveReport report = model.solve(0.0, beyond).report;
  EXPECT_EQ(report.reason, SolveReason::beyond_law);
  ASSERT_TRUE(report.beyond_law.has_value());
  EXPECT_NE(report.describe().find("the law has no stress at the strain of element 0"), std::string::npos);
  EXPECT_TRUE(model.solve(1.0).report.converged());  // from rest, steps that would cross a pole are cut back
}

TEST(Failure, InvertedElementIsReportedWithItsPlace) {
  ElasticModel model = gel(6.5);
  ElasticState crossed = model.rest_state();
  const size_t node = 8 * 2;  // mid-height, inner wall, on the x axis: pushed through the outer wall
  crossed.position_mm[dof_of(node, 0, 0)] = 70.0;
  const Solution solution = model.solve(0.0, crossed);
  EXPECT_EQ(solution.report.reason, SolveReason::inverted_element);
  ASSERT_TRUE(solution.report.inverted);
  EXPECT_LE(solution.report.inverted->volume_ratio, 0.0);
  const MaterialPoint& place = solution.report.inverted->point;
  EXPECT_THAT(place.element, testing::AnyOf(8U, 15U, 16U, 23U));  // those around the node
  EXPECT_TRUE(
      model.mesh().value(model.mesh().reference(), place).isApprox(solution.report.inverted->reference_mm));
  EXPECT_THAT(solution.report.describe(),
              testing::HasSubstr("element " + std::to_string(place.element) + " turns inside out at xi = ("));
  EXPECT_GT(solution.report.inverted->reference_mm[0], 20.0);
  EXPECT_LT(std::abs(solution.report.inverted->reference_mm[2]), 25.0);
  EXPECT_NE(solution.report.describe().find("turns inside out"), std::string::npos);
}

TEST(Failure, ALoadBeyondTheLimitEndsWithTheLastEquilibriumAndTheHistory) {
  ElasticModel model = gel(2.0, {6, 2, 1});
  const Solution solution = model.solve(50.0);
  EXPECT_FALSE(solution.report.converged());
  EXPECT_LT(solution.report.reached_pressure_kPa, 50.0);
  EXPECT_EQ(solution.state.pressure_kPa, solution.report.reached_pressure_kPa);
  EXPECT_GT(solution.report.history.size(), 1U);
  EXPECT_FALSE(solution.report.history.back().accepted);
  EXPECT_NE(solution.report.describe().find("was reached"), std::string::npos);
}

// An inclusion in one element through the wall: while the pressure had to follow its stiffness, what a point moves was off by more than it moves.
TEST(UnevenStiffness, BendsACoarseMeshAsItBendsAFineOne) {
  for (const double contrast : {0.3, 4.0}) {
    ElasticModel coarse = gel(6.5, {8, 4, 1}, {.stiffness = inclusion(contrast)});
    ElasticModel fine = gel(6.5, {14, 7, 3}, {.stiffness = inclusion(contrast)});
    const Solution on_coarse = coarse.solve(4.0), on_fine = fine.solve(4.0);
    ASSERT_TRUE(on_coarse.report.converged());
    ASSERT_TRUE(on_fine.report.converged());
    const double volume_mm3 = fine.system().cavity_volume_mm3(on_fine.state);
    EXPECT_NEAR(coarse.system().cavity_volume_mm3(on_coarse.state), volume_mm3, 1e-3 * volume_mm3);
    for (const double radius_mm : {23.0, 30.0, 36.4, 43.0, 49.0}) {
      const Eigen::Vector3d X_mm =
          radius_mm * Eigen::Vector3d(10.0, 35.0, 0.0).normalized() + 8.0 * Eigen::Vector3d::UnitZ();
      const auto displacement_mm = [&](ElasticModel& model, const Solution& solution) {
        const HermiteMesh& mesh = model.mesh();
        const MaterialPoint place = PointLocator(mesh, mesh.reference()).find(X_mm).value().point;
        return Eigen::Vector3d(mesh.value(solution.state.position_mm, place) - X_mm);
      };
      const Eigen::Vector3d truth_mm = displacement_mm(fine, on_fine);
      EXPECT_LT((displacement_mm(coarse, on_coarse) - truth_mm).norm(), 0.1 * truth_mm.norm())
          << contrast << " at " << radius_mm;
    }
  }
}

TEST(Failure, NoConvergenceIsReportedWithItsHistory) {
  ElasticModel model = gel(6.5, {6, 2, 1}, {.solve = {.newton_limit = 1, .least_load_fraction = 0.6}});
  const Solution solution = model.solve(20.0);
  EXPECT_EQ(solution.report.reason, SolveReason::no_convergence);
  ASSERT_EQ(solution.report.history.size(), 1U);
  EXPECT_FALSE(solution.report.history[0].accepted);
  EXPECT_EQ(solution.report.history[0].pressure_kPa, 20.0);
  ASSERT_EQ(solution.report.history[0].iterations.size(), 1U);
  EXPECT_GT(solution.report.history[0].iterations[0].step, 1e-3);
  EXPECT_EQ(solution.state.position_mm, model.rest_state().position_mm);
  EXPECT_THAT(solution.report.describe(),
              testing::AllOf(testing::HasSubstr("no convergence"),
                             testing::HasSubstr("the last attempt at 20 kPa had corrections")));
}

TEST(Failure, TheLoadStepLimitIsAReasonOfItsOwn) {
  ElasticModel model = gel(6.5, {6, 2, 1}, {.solve = {.load_step_limit = 2, .most_load_fraction = 0.25}});
  const Solution solution = model.solve(4.0);
  EXPECT_EQ(solution.report.reason, SolveReason::out_of_steps);
  EXPECT_EQ(solution.report.load_steps, 2U);
  EXPECT_NEAR(solution.state.pressure_kPa, 2.0, 1e-12);
}

TEST(Failure, MissingSupportsAreASingularTangent) {
  HermiteMesh mesh = make_annulus(gel_shape({4, 1, 1}));
  const HeldDofs held = hold_nothing(mesh);
  ElasticModel model(std::move(mesh), *find_law("neo-hookean"), {.parameters = {6.5}, .held = held});
  const SolveReport report = model.solve(0.0).report;
  EXPECT_EQ(report.reason, SolveReason::singular_tangent);
  EXPECT_THAT(report.describe(), testing::HasSubstr("its supports or springs do not hold it"));
}

}  // namespace
}  // namespace diastole
