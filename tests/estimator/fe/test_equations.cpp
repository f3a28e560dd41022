// The discrete equations: residual, tangent, cavity load, sums that do not depend on the number of threads.

#include <gtest/gtest.h>

#include "tests/estimator/fe/derivative_check.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

/// Pi of element_mechanics.hpp; the Lagrange term follows from the residual's pressure rows, which are
/// dPi/dp.
double potential(const ElasticSystem& system, const ElasticState& state) {
  const SystemResidual residual = system.residual(state);
  double lagrange = 0.0;
  for (size_t i = 0; i < state.lagrange_pressure_kPa.size(); ++i) {
    lagrange +=
        state.lagrange_pressure_kPa[i] * residual.values[system.equations().displacement_unknowns() + i];
  }
  return residual.energy_uJ + lagrange - state.pressure_kPa * system.cavity_volume_mm3(state);
}

class Equations : public testing::TestWithParam<const Law*> {
 protected:
  Equations() {
    std::vector<double> values;
    for (const LawParameter& parameter : GetParam()->parameters())
      values.push_back(parameter.typical);
    model_.emplace(make_annulus(gel_shape({5, 3, 2})), *GetParam(),
                   ElasticOptions{.parameters = values, .stiffness = inclusion(4.0)});
    state_ = shaken(model_->system(), model_->rest_state(), 0.4, 5);
    state_.pressure_kPa = 3.0;
  }
  std::optional<ElasticModel> model_;
  ElasticState state_;
};

TEST_P(Equations, ResidualIsTheDerivativeOfThePotential) {
  ElasticSystem& system = model_->system();
  const SystemResidual residual = system.residual(state_);
  for (unsigned seed = 1; seed < 6; ++seed) {
    const std::vector<double> step = random_step(model_->dofs(), seed);
    constexpr double h = 1e-5;
    const double slope = (potential(system, system.moved(state_, step, h)) -
                          potential(system, system.moved(state_, step, -h))) /
                         (2 * h);
    double along = 0.0;
    for (size_t i = 0; i < step.size(); ++i)
      along += residual.values[i] * step[i];
    EXPECT_NEAR(along, slope, 1e-6 * std::abs(slope));
  }
}

// The tangent is stored as one triangle, so this also shows that the true derivative is symmetric, follower
// load included.
TEST_P(Equations, TangentIsTheDerivativeOfTheResidual) {
  ElasticSystem& system = model_->system();
  for (unsigned seed = 1; seed < 4; ++seed) {
    const std::vector<double> step = random_step(model_->dofs(), seed);
    constexpr double h = 1e-5;
    const std::vector<double> low = system.residual(system.moved(state_, step, -h)).values;
    std::vector<double> slope = system.residual(system.moved(state_, step, h)).values;
    for (size_t i = 0; i < slope.size(); ++i)
      slope[i] = (slope[i] - low[i]) / (2 * h);
    EXPECT_LT(largest_difference(tangent_times(system, state_, step), slope), 1e-6 * largest(slope));
  }
}

TEST_P(Equations, ParameterDerivativeIsThatOfTheResidual) {
  ElasticSystem& system = model_->system();
  const std::vector<size_t> some{3, 7, 8};
  for (size_t parameter = 0; parameter < GetParam()->parameters().size(); ++parameter) {
    std::vector<double> exact(model_->dofs(), 0.0);
    system.add_parameter_residual(state_, parameter, some, exact);
    const double value = model_->element_parameter(parameter, 0);
    const double h = 1e-5 * value;
    const auto residual_with = [&](double changed) {
      for (const size_t e : some)
        model_->set_element_parameter(parameter, e, changed);
      return system.residual(state_).values;
    };
    std::vector<double> slope = residual_with(value + h);
    const std::vector<double> low = residual_with(value - h);
    for (size_t i = 0; i < slope.size(); ++i)
      slope[i] = (slope[i] - low[i]) / (2 * h);
    residual_with(value);
    EXPECT_LT(largest_difference(exact, slope), 1e-7 * largest(exact));
  }
}

TEST_P(Equations, SumsAreTheSameForAnyNumberOfThreads) {
  std::vector<double> values;
  for (const LawParameter& parameter : GetParam()->parameters())
    values.push_back(parameter.typical);
  std::vector<std::vector<double>> residuals;
  std::vector<std::vector<double>> tangents;
  for (const size_t threads : {1U, 2U, 5U}) {
    ElasticModel model(make_annulus(gel_shape({5, 3, 2})), *GetParam(),
                       ElasticOptions{.parameters = values, .threads = threads});
    residuals.push_back(model.system().residual(state_).values);
    tangents.push_back(model.system().tangent(state_));
  }
  for (size_t run = 1; run < 3; ++run) {
    EXPECT_EQ(residuals[run], residuals[0]);
    EXPECT_EQ(tangents[run], tangents[0]);
  }
}

// A rigid rotation of the whole body, about a slanting axis, leaves the ends where a turned plate would hold them: no force
// anywhere.
TEST_P(Equations, RigidMotionIsStressFree) {
  ElasticSystem& system = model_->system();
  ElasticState state = model_->rest_state();
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(0.3, -1.0, 0.6).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(5.0, -3.0, 2.0);
  for (size_t node = 0; node < model_->mesh().node_count(); ++node) {
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      double* at = &state.position_mm[dof_of(node, d, 0)];
      Eigen::Vector3d moved = rotation * Eigen::Vector3d(at);
      if (d == 0) moved += shift;
      std::copy_n(moved.data(), 3, at);
    }
  }
  const SystemResidual residual = system.residual(state);
  EXPECT_LT(largest(residual.values), 1e-9);
  EXPECT_NEAR(residual.energy_uJ, 0.0, 1e-7);
}

// Objectivity: turned as a whole, a deformed and loaded body has its forces turned with it, and nothing else changes.
TEST_P(Equations, ForcesTurnWithTheBody) {
  std::vector<double> values;
  for (const LawParameter& parameter : GetParam()->parameters())
    values.push_back(parameter.typical);
  const HermiteMesh& mesh = model_->mesh();
  ElasticModel free(mesh, *GetParam(), {.parameters = values, .held = hold_nothing(mesh)});
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.7, 0.4, -0.6).normalized()).toRotationMatrix();
  const auto turn = [&](std::vector<double>& numbers, size_t count) {
    for (size_t start = 0; start < count; start += 3) {
      const Eigen::Vector3d turned = rotation * Eigen::Vector3d(&numbers[start]);
      std::copy_n(turned.data(), 3, &numbers[start]);
    }
  };
  SystemResidual before = free.system().residual(state_);
  turn(before.values, free.system().equations().displacement_unknowns());
  ElasticState turned = state_;
  turn(turned.position_mm, turned.position_mm.size());
  const SystemResidual after = free.system().residual(turned);
  EXPECT_LT(largest_difference(after.values, before.values), 1e-11 * largest(before.values));
  EXPECT_NEAR(after.energy_uJ, before.energy_uJ, 1e-11 * std::abs(before.energy_uJ));
}

INSTANTIATE_TEST_SUITE_P(Laws, Equations, testing::Values(find_law("neo-hookean"), &fibre_exponential()),
                         [](const auto& listed) {
                           return listed.index == 0 ? "neo_hookean" : "fibre_exponential";
                         });

TEST(CavityLoad, AreaIsTheDerivativeOfTheVolume) {
  ElasticModel model = gel(6.5, {5, 3, 1});
  ElasticSystem& system = model.system();
  const ElasticState state = shaken(system, model.rest_state(), 0.4, 9);
  EXPECT_LT(area_fault(system, state), 1e-8);
}

TEST(CavityLoad, VolumeOfTheUndeformedCavityIsACylinders) {
  const ElasticModel model = gel(6.5);
  EXPECT_NEAR(model.cavity_volume_mL(model.rest_state()), 3.14159265 * 22.5 * 22.5 * 85.0 * 1e-3, 1e-3);
}

TEST(SparseFactor, SolvesAndCountsNegativePivots) {
  // [2 1 0; 1 -3 1; 0 1 0]: eigenvalues of both signs and a zero on the diagonal.
  const std::vector<int> rows{1, 2, 2, 3};
  const std::vector<int> columns{1, 1, 2, 2};
  std::vector<double> values{2.0, 1.0, -3.0, 1.0};
  SparseFactor factor(3, rows, columns);
  const FactorResult result = factor.factorise(values);
  EXPECT_FALSE(result.singular);
  EXPECT_EQ(result.negative_pivots, 1U);
  std::vector<double> right{4.0, -2.0, 2.0, 2.0, 1.0, 0.0};
  factor.solve(right, 2);
  const std::vector<double> expected{1.0, 2.0, 3.0, 1.0, 0.0, 0.0};
  for (size_t i = 0; i < right.size(); ++i)
    EXPECT_NEAR(right[i], expected[i], 1e-14);
}

TEST(SparseFactor, ReportsASingularMatrix) {
  const std::vector<int> rows{1, 2, 2};
  const std::vector<int> columns{1, 1, 2};
  std::vector<double> values{1.0, 1.0, 1.0};
  SparseFactor factor(2, rows, columns);
  EXPECT_TRUE(factor.factorise(values).singular);
}

}  // namespace
}  // namespace diastole
