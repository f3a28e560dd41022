// Cavity volume held, sealed chamber, springs, free rims, finite bulk: their equations, limits and balances.

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "estimator/fe/force_balance.hpp"
#include "estimator/fe/pressure_volume.hpp"
#include "estimator/mesh/block.hpp"
#include "tests/estimator/fe/derivative_check.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

std::vector<BondedFaces> sprung_ends(const HermiteMesh& mesh, const SpringBond& bond) {
  return {{mesh.faces().bottom, bond}, {mesh.faces().top, bond}};
}

ElasticModel sprung_gel(double c1_kPa, const SpringBond& bond, ElasticOptions options = {}) {
  HermiteMesh mesh = make_annulus(gel_shape({5, 3, 1}));
  options.parameters = {c1_kPa};
  options.solve.check_stability = true;
  options.bonded = sprung_ends(mesh, bond);
  return ElasticModel(std::move(mesh), *find_law("neo-hookean"), std::move(options));
}

/// Everything at once, rims off their plates, in a state that is no equilibrium.
TEST(LoadsAndSupports, TangentIsTheDerivativeOfTheResidual) {
  ElasticModel model = sprung_gel(6.5, {.normal_kPa_per_mm = 3.0, .tangential_kPa_per_mm = 2.0},
                                  {.chamber = Chamber{0.5, 20.0}, .bulk_modulus_kPa = 80.0});
  ElasticSystem& system = model.system();
  ElasticState state = shaken(system, model.rest_state(), 0.4, 5);
  state.pressure_kPa = 3.0;
  state.chamber_pressure_kPa = 1.2;
  EXPECT_TRUE(system.rim_skew().empty());
  EXPECT_LT(tangent_fault(system, state), 1e-6);
  state.held_volume_mm3 = 1.1 * system.cavity_volume_mm3(state);
  EXPECT_EQ(system.residual(state).values.size(), model.dofs() + 1);
  EXPECT_LT(tangent_fault(system, state), 1e-6);
}

TEST(LoadsAndSupports, TangentOfAFreeRimHasItsSkewPart) {
  HermiteMesh mesh = make_block({{4.0, 2.0, 1.0}, {2, 1, 1}});
  HeldDofs held = hold_nothing(mesh);
  hold_face(mesh, mesh.faces().left, held);
  ElasticModel model(std::move(mesh), *find_law("neo-hookean"), {.parameters = {6.5}, .held = held});
  ElasticSystem& system = model.system();
  ElasticState state = shaken(system, model.rest_state(), 0.1, 5);
  state.pressure_kPa = 3.0;
  EXPECT_FALSE(system.rim_skew().empty());
  EXPECT_FALSE(system.cavity_closed());
  EXPECT_LT(tangent_fault(system, state), 1e-6);
}

/// Land's beam, shortened: one side pushed, all its rims free but the clamped one.
ElasticModel pushed_beam() {
  HermiteMesh mesh = make_block({{6.0, 1.0, 1.0}, {6, 1, 1}, 0.8});
  HeldDofs held = hold_nothing(mesh);
  hold_face(mesh, mesh.faces().left, held);
  return ElasticModel(std::move(mesh), *find_law("guccione"),
                      {.parameters = {2.0, 8.0, 2.0, 4.0}, .held = held});
}

// The first guess of a bending beam is far off: steps are damped. With the skew part the last ones converge
// quadratically, and sensitivities are exact.
TEST(FreeRim, IsSolvedByDampedThenQuadraticSteps) {
  ElasticModel model = pushed_beam();
  const Solution solution = model.solve(0.01);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
  EXPECT_LT(solution.report.history.front().iterations.front().damping, 1.0);
  EXPECT_LE(model.solve(0.0101, solution.state).report.factorisations, 2U);
  const Sensitivities exact = model.sensitivities(solution.state, {});
  const NodeField high = model.solve(0.01001, solution.state).state.position_mm;
  const NodeField low = model.solve(0.00999, solution.state).state.position_mm;
  NodeField slope(high.size());
  for (size_t i = 0; i < slope.size(); ++i)
    slope[i] = (high[i] - low[i]) / 2e-5;
  EXPECT_LT(largest_difference(exact.pressure, slope), 1e-5 * largest(slope));
}

TEST(LoadsAndSupports, ParameterDerivativeOfCompressibleMaterialIsThatOfTheResidual) {
  ElasticModel model = gel(6.5, {5, 3, 1}, {.bulk_modulus_kPa = 80.0});
  const ElasticState state = shaken(model.system(), model.rest_state(), 0.4, 5);
  std::vector<double> exact(model.dofs(), 0.0);
  model.system().add_parameter_residual(state, 0, {}, exact);
  model.set_parameter(0, 6.5 + 1e-4);
  std::vector<double> slope = model.system().residual(state).values;
  model.set_parameter(0, 6.5 - 1e-4);
  const std::vector<double> low = model.system().residual(state).values;
  for (size_t i = 0; i < slope.size(); ++i)
    slope[i] = (slope[i] - low[i]) / 2e-4;
  EXPECT_LT(largest_difference(exact, slope), 1e-7 * largest(exact));
}

TEST(FreeRim, LeavesStabilityUndecided) {
  ElasticModel model = pushed_beam();
  EXPECT_FALSE(model.system().stability(model.rest_state()).unstable_motions);
  EXPECT_FALSE(model.solve(0.001).report.stable());
}

TEST(LoadsAndSupports, WhatNothingHoldsIsNotStableAndHasNoDerivatives) {
  ElasticModel model = sprung_gel(6.5, {0.0, 0.0});
  const Stability stability = model.system().stability(model.rest_state());
  EXPECT_TRUE(stability.singular);
  EXPECT_FALSE(stability.stable());
  EXPECT_THROW((void)model.sensitivities(model.rest_state(), {}), std::domain_error);
  EXPECT_FALSE(model.cavity_stiffness_kPa_per_mL(model.rest_state()));
}

TEST(LoadsAndSupports, SensitivitiesEqualFiniteDifferencesOfNewSolutions) {
  ElasticModel model = sprung_gel(6.5, {3.0, 2.0}, {.chamber = Chamber{0.5, 20.0}, .bulk_modulus_kPa = 80.0});
  const Solution solution = model.solve(4.0);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  const Sensitivities exact = model.sensitivities(solution.state, std::vector{whole_parameter(0)});
  EXPECT_EQ(exact.negative_pivots, solution.report.pressure_unknowns);
  const auto solved = [&](double c1_kPa, double pressure_kPa) {
    model.set_parameter(0, c1_kPa);
    return model.solve(pressure_kPa, solution.state).state.position_mm;
  };
  const auto slope = [](NodeField high, const NodeField& low, double step) {
    for (size_t i = 0; i < high.size(); ++i)
      high[i] = (high[i] - low[i]) / (2.0 * step);
    return high;
  };
  constexpr double step = 1e-3;
  const NodeField by_c1 = slope(solved(6.5 + step, 4.0), solved(6.5 - step, 4.0), step);
  const NodeField by_pressure = slope(solved(6.5, 4.0 + step), solved(6.5, 4.0 - step), step);
  EXPECT_LT(largest_difference(exact.parameter[0], by_c1), 1e-5 * largest(by_c1));
  EXPECT_LT(largest_difference(exact.pressure, by_pressure), 1e-5 * largest(by_pressure));
}

TEST(LoadsAndSupports, SolutionsAreTheSameForAnyNumberOfThreads) {
  std::vector<ElasticState> states;
  for (const size_t threads : {1U, 2U, 4U, 2U}) {
    ElasticModel model = sprung_gel(6.5, {3.0, 2.0}, {.chamber = Chamber{0.5, 20.0}, .threads = threads});
    const double rest_mL = model.cavity_volume_mL(model.rest_state());
    states.push_back(model.solve({.cavity_volume_mL = rest_mL + 20.0}, model.rest_state()).state);
    EXPECT_EQ(states.back().position_mm, states.front().position_mm);
    EXPECT_EQ(states.back().pressure_kPa, states.front().pressure_kPa);
    EXPECT_EQ(states.back().chamber_pressure_kPa, states.front().chamber_pressure_kPa);
  }
}

// The wall's area vectors are the volume's derivative, gaps at the plates included.
TEST(LoadsAndSupports, VolumeBetweenWallAndPlatesHasTheAreaAsItsDerivative) {
  ElasticModel model = sprung_gel(6.5, {1.0, 1.0});
  ElasticSystem& system = model.system();
  const ElasticState state = shaken(system, model.rest_state(), 0.6, 9);
  EXPECT_LT(area_fault(system, state), 1e-8);
}

/// All nodes moved by one affine map.
ElasticState mapped(const ElasticModel& model, const Eigen::Matrix3d& f, const Eigen::Vector3d& shift) {
  ElasticState state = model.rest_state();
  for (size_t start = 0; start < state.position_mm.size(); start += 3) {
    Eigen::Vector3d moved = f * Eigen::Vector3d(&state.position_mm[start]);
    if (start % dofs_per_node == 0) moved += shift;
    std::copy_n(moved.data(), 3, &state.position_mm[start]);
  }
  return state;
}

// A tilted cylinder between horizontal plates: the volume of the fluid is known, and does not depend on where the
// origin is.
TEST(LoadsAndSupports, VolumeOfALeaningCylinderIsExact) {
  const ElasticModel model = sprung_gel(6.5, {1.0, 1.0});
  const double rest_mL = model.cavity_volume_mL(model.rest_state());
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(0, 2) = 0.3;
  EXPECT_NEAR(model.cavity_volume_mL(mapped(model, shear, {7.0, -4.0, 0.0})), rest_mL, 1e-9);
  Eigen::Matrix3d shorter = Eigen::Matrix3d::Identity();
  shorter(2, 2) = 0.8;  // rims leave the plates; the gaps' strips complete the cylinder
  EXPECT_NEAR(model.cavity_volume_mL(mapped(model, shorter, {7.0, -4.0, 3.0})), rest_mL, 1e-9);
}

TEST(HeldVolume, GivesThePressureThatGivesTheVolume) {
  ElasticModel model = gel(6.5);
  const Solution by_pressure = model.solve(6.0);
  const double volume_mL = model.cavity_volume_mL(by_pressure.state);
  const Solution by_volume = model.solve({.cavity_volume_mL = volume_mL}, model.rest_state());
  ASSERT_TRUE(by_volume.report.converged()) << by_volume.report.describe();
  EXPECT_NEAR(by_volume.state.pressure_kPa, 6.0, 1e-8);
  EXPECT_NEAR(model.cavity_volume_mL(by_volume.state), volume_mL, 1e-9);
  EXPECT_LT(largest_difference(by_volume.state.position_mm, by_pressure.state.position_mm), 1e-7);
  EXPECT_EQ(by_volume.report.pressure_unknowns, model.pressure_dofs() + 1);
  EXPECT_EQ(by_volume.report.negative_pivots, by_volume.report.pressure_unknowns);
}

TEST(HeldVolume, StiffnessOfTheCavityIsTheCurvesSlope) {
  ElasticModel model = gel(6.5, {6, 3, 1});
  const Solution middle = model.solve(3.0);
  constexpr double h_kPa = 1e-3;
  const double volume_change_mL = model.cavity_volume_mL(model.solve(3.0 + h_kPa, middle.state).state) -
                                  model.cavity_volume_mL(model.solve(3.0 - h_kPa, middle.state).state);
  EXPECT_NEAR(model.cavity_stiffness_kPa_per_mL(middle.state).value(), 2 * h_kPa / volume_change_mL, 1e-6);
}

TEST(SealedChamber, HoldsBackWhatTheSpecimenTakes) {
  constexpr double compliance_mL_per_kPa = 25.0;
  ElasticModel model = gel(6.5, {8, 4, 1}, {.chamber = Chamber{0.0, compliance_mL_per_kPa}});
  const Solution solution = model.solve(6.0);
  ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
  EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
  EXPECT_EQ(solution.report.pressure_unknowns, model.pressure_dofs() + 1);
  const double swelling_mL = 1e-3 * model.system().chamber_intake_mm3(solution.state);
  const double volume_change_mL =
      model.cavity_volume_mL(solution.state) - model.cavity_volume_mL(model.rest_state());
  EXPECT_NEAR(swelling_mL, volume_change_mL, 1e-5 * volume_change_mL);  // the gel keeps its volume
  EXPECT_NEAR(solution.state.chamber_pressure_kPa, swelling_mL / compliance_mL_per_kPa, 1e-8);
  // Only the difference of the two pressures deforms an incompressible body whose rims are held; what is left is the
  // error of 4x4x4 points on curved elements.
  const Solution alone = gel(6.5).solve(6.0 - solution.state.chamber_pressure_kPa);
  EXPECT_LT(largest_difference(alone.state.position_mm, solution.state.position_mm), 1e-3);
}

TEST(SealedChamber, IsOpenInTheLimitAndAppliesItsSealingPressure) {
  const auto wall_mm = [](ElasticModel model, double pressure_kPa = 5.0) {
    const Solution solution = model.solve(pressure_kPa);
    EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
    const MaterialPoint middle{6, {0.0, 0.5, 0.0}};
    return model.mesh().value(solution.state.position_mm, middle)[0];
  };
  const double open = wall_mm(gel(6.5, {6, 3, 1}, {.chamber = Chamber{.sealing_pressure_kPa = 1.5}}));
  EXPECT_NEAR(open, wall_mm(gel(6.5, {6, 3, 1}), 3.5), 1e-3);
  std::vector<double> faults;
  for (const double compliance : {1e3, 1e4, 1e5})
    faults.push_back(wall_mm(gel(6.5, {6, 3, 1}, {.chamber = Chamber{1.5, compliance}})) - open);
  EXPECT_LT(faults[0], 0.0);
  EXPECT_NEAR(faults[0] / faults[1], 10.0, 0.7);
  EXPECT_NEAR(faults[1] / faults[2], 10.0, 0.1);
}

TEST(SprungEnds, BecomeHeldOnesLikeOneOverTheStiffness) {
  const Solution held = gel(6.5, {5, 3, 1}).solve(4.0);
  std::vector<double> faults;
  for (const double stiffness : {1e3, 1e4, 1e5}) {
    ElasticModel model = sprung_gel(6.5, {stiffness, stiffness});
    const Solution sprung = model.solve(4.0);
    ASSERT_TRUE(sprung.report.converged()) << sprung.report.describe();
    EXPECT_EQ(sprung.report.negative_pivots, sprung.report.pressure_unknowns);
    double most_mm = 0.0;
    for (size_t node = 0; node < model.mesh().node_count(); ++node) {
      for (size_t i = 0; i < 3; ++i) {
        const size_t dof = dof_of(node, 0, i);
        most_mm = std::max(most_mm, std::abs(sprung.state.position_mm[dof] - held.state.position_mm[dof]));
      }
    }
    faults.push_back(most_mm);
  }
  EXPECT_LT(faults[0], 0.1);
  EXPECT_NEAR(faults[0] / faults[1], 10.0, 2.0);
  EXPECT_NEAR(faults[1] / faults[2], 10.0, 1.0);
}

/// A tube whose ends slide on springs too soft to matter, against one that is only kept from moving as a whole.
TEST(SprungEnds, BecomeFreeOnesAsTheyVanish) {
  const AnnulusShape shape = gel_shape({8, 3, 1});
  const HermiteMesh mesh = make_annulus(shape);
  HeldDofs pins = hold_nothing(mesh);
  pins[dof_of(8, 0, 1)] = pins[dof_of(12, 0, 1)] = pins[dof_of(10, 0, 0)] =
      1;  // on the axes, below the middle
  hold_face_component(mesh, mesh.faces().bottom, 2, pins);
  const auto solved = [&](double tangential) {
    ElasticOptions options{.parameters = {6.5}, .held = pins};
    options.bonded = {{mesh.faces().bottom, {0.0, tangential}}, {mesh.faces().top, {0.0, tangential}}};
    ElasticModel model(mesh, *find_law("neo-hookean"), options);
    const Solution solution = model.solve(1.0);
    EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
    return solution.state.position_mm;
  };
  const NodeField free = solved(0.0);
  const double far = largest_difference(solved(1e-3), free);
  const double near = largest_difference(solved(1e-4), free);
  EXPECT_LT(near, 1e-2);
  EXPECT_NEAR(far / near, 10.0, 0.2);
}

TEST(SprungEnds, BalanceTheEnergy) {
  ElasticModel model = sprung_gel(6.5, {0.5, 0.5});
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = 30.0, .steps = 5});
  ASSERT_TRUE(curve.last.converged()) << curve.last.describe();
  const double stored_mJ = curve.points.back().stored_energy_mJ;
  EXPECT_NEAR(curve.work_mJ(), stored_mJ, 1e-5 * stored_mJ);
  EXPECT_GT(model.system().residual(curve.state).bond_energy_uJ, 1e-2 * 1e3 * stored_mJ);
}

TEST(Forces, OfSupportsAndFluidsAddUpToNothing) {
  for (const bool sprung : {false, true}) {
    ElasticOptions options{.chamber = Chamber{0.7, 30.0}};
    ElasticModel model = sprung ? sprung_gel(6.5, {2.0, 1.0}, options) : gel(6.5, {5, 3, 1}, options);
    const Solution solution = model.solve(5.0);
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    const ForceBalance balance = force_balance(model.system(), solution.state);
    ASSERT_EQ(balance.supports.size(), 2U);
    EXPECT_EQ(balance.supports[0].face, "bottom");
    EXPECT_LT(balance.unbalanced_N.norm(), 1e-6);
    EXPECT_GT(std::abs(balance.supports[0].force_N[2]), 1.0);
    EXPECT_NEAR(balance.supports[0].force_N[2], -balance.supports[1].force_N[2], 1e-6);
  }
}

// Of a beam pushed from below: the clamp takes the whole load, and the load is pressure times area at first.
TEST(Forces, OfTheClampOfABeam) {
  HermiteMesh mesh = make_block({{4.0, 2.0, 1.0}, {2, 1, 1}});
  HeldDofs held = hold_nothing(mesh);
  hold_face(mesh, mesh.faces().left, held);
  ElasticModel model(std::move(mesh), *find_law("neo-hookean"), {.parameters = {6.5}, .held = held});
  const Solution solution = model.solve(1e-4);
  ASSERT_TRUE(solution.report.converged());
  const ForceBalance balance = force_balance(model.system(), solution.state);
  ASSERT_EQ(balance.supports.size(), 1U);
  EXPECT_EQ(balance.supports[0].face, "left");
  constexpr double load_N = 1e-3 * 1e-4 * 8.0;
  EXPECT_NEAR(balance.cavity_N[2], load_N, 1e-4 * load_N);
  EXPECT_NEAR(balance.supports[0].force_N[2], -load_N, 1e-4 * load_N);
  EXPECT_LT(balance.unbalanced_N.norm(), 1e-9 * load_N);
}

// Nearly incompressible material becomes the incompressible one like 1/K.
TEST(FiniteBulk, ConvergesToTheIncompressibleSolution) {
  const auto volume_change_mL = [](ElasticModel model) {
    const Solution solution = model.solve(4.0);
    EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
    EXPECT_EQ(solution.report.negative_pivots, solution.report.pressure_unknowns);
    return model.cavity_volume_mL(solution.state) - model.cavity_volume_mL(model.rest_state());
  };
  const double incompressible = volume_change_mL(gel(6.5, {6, 3, 1}));
  std::vector<double> faults;
  for (const double bulk_kPa : {1e3, 1e4, 1e5})
    faults.push_back(volume_change_mL(gel(6.5, {6, 3, 1}, {.bulk_modulus_kPa = bulk_kPa})) - incompressible);
  EXPECT_GT(faults[0], 0.0);
  EXPECT_LT(faults[0], 0.02 * incompressible);
  EXPECT_NEAR(faults[0] / faults[1], 10.0, 0.3);
  EXPECT_NEAR(faults[1] / faults[2], 10.0, 0.1);
}

}  // namespace
}  // namespace diastole
