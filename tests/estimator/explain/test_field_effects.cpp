// What every effect that shows in images must keep.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "estimator/explain/imaging/explain_field.hpp"
#include "tests/estimator/explain/simulated_field.hpp"

namespace diastole::explain {
namespace {

std::vector<double> typical(const Effect& effect) {
  std::vector<double> values;
  for (const EffectParameter& parameter : effect.field_parameters())
    values.push_back(parameter.typical);
  return values;
}

/// Typical sizes, all parameters free.
FieldChoice all_free(const Effect& effect) {
  FieldChoice choice{{&effect}, typical(effect), {}};
  for (size_t i = 0; i < choice.values.size(); ++i)
    choice.free.push_back(i);
  return choice;
}

class EveryFieldEffect : public testing::TestWithParam<const Effect*> {
 protected:
  [[nodiscard]] const Effect& effect() const { return *GetParam(); }
};

TEST_P(EveryFieldEffect, IsTheBaseModelExactlyWhereNeutral) {
  FieldModel base;
  base.inner_radius_mm = 20.0;
  FieldModel model = base;
  effect().apply_to_field(effect().field_neutral(base), model);
  EXPECT_EQ(model, base);
  effect().apply_to_field(typical(effect()), model);
  EXPECT_NE(model, base);
}

TEST_P(EveryFieldEffect, HasBoundsAroundItsNeutralAndTypicalSize) {
  for (const EffectParameter& parameter : effect().field_parameters()) {
    EXPECT_LE(parameter.lower, parameter.neutral) << parameter.name;
    EXPECT_LE(parameter.neutral, parameter.upper) << parameter.name;
    EXPECT_LT(parameter.lower, parameter.typical) << parameter.name;
    EXPECT_LT(parameter.typical, parameter.upper) << parameter.name;
  }
}

TEST_P(EveryFieldEffect, HasExactDerivatives) {
  SimulatedField few;
  few.points = 60;
  FieldProblem problem(simulated_case(few), small_mesh);
  const FieldProblem::Start start{8.0, problem.start().pressures_kPa};
  constexpr int here = 0;  // no iteration
  const FieldChoice choice = all_free(effect());
  const FieldFit at = problem.fit(choice, start, here);
  for (size_t i = 0; i < choice.values.size(); ++i) {
    const EffectParameter& parameter = effect().field_parameters()[i];
    const double step =
        parameter.scale == SearchScale::logarithmic ? 1e-3 : 1e-3 * std::abs(parameter.typical);
    FieldChoice up = choice;
    FieldChoice down = choice;
    const inference::Parameter scale = searched(parameter);
    up.values[i] = scale.value(scale.coordinate(choice.values[i]) + step);
    down.values[i] = scale.value(scale.coordinate(choice.values[i]) - step);
    const Eigen::VectorXd difference =
        (problem.fit(up, start, here).residuals - problem.fit(down, start, here).residuals) / (2.0 * step);
    const Eigen::VectorXd exact = at.jacobian.col(1 + static_cast<Eigen::Index>(i)).head(difference.size());
    EXPECT_LE((exact - difference).norm(), 1e-3 * difference.norm() + 1e-6) << parameter.name;
  }
}

TEST_P(EveryFieldEffect, IsFoundAgainInItsOwnData) {
  SimulatedField field;
  const std::vector<double> truth = typical(effect());
  effect().apply_to_field(truth, field.truth);
  FieldCase measured = simulated_case(field);
  measured.C1_start_kPa = {8.0, 0.02};  // else a gain of the displacement is the modulus
  FieldProblem problem(measured, small_mesh);
  const FieldFit base = problem.fit({}, problem.start());
  FieldChoice start = all_free(effect());
  start.free.resize(effect().field_essentials());
  const double neutral = effect().field_neutral(measured.base)[0];
  start.values[0] =
      std::isfinite(neutral) && neutral < 100.0 ? neutral + 0.7 * (truth[0] - neutral) : 2.0 * truth[0];
  const FieldFit fit = problem.fit(start, {base.C1_kPa(), base.pressures_kPa});
  EXPECT_TRUE(inference::is_settled(fit.termination));
  EXPECT_LT(fit.chi_square, base.chi_square - 100.0);
  const double error = std::sqrt(fit.covariance(1, 1));
  const inference::Parameter size = searched(effect().field_parameters()[0]);
  EXPECT_NEAR(size.coordinate(fit.choice.values[0]), size.coordinate(truth[0]), 5.0 * error);
}

std::string test_name(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(List, EveryFieldEffect, testing::ValuesIn(field_effects()), test_name);

TEST(FieldProblem, AModulusOnItsBoundHasNoErrorAndAddsNoneToTheOthers) {
  FieldCase field = simulated_case({.pressures_kPa = {3.0}});
  field.C1_bounds_kPa = {1.0, 7.5};
  FieldProblem problem(field, small_mesh);
  const FieldFit fit = problem.fit({}, problem.start());
  EXPECT_EQ(fit.termination, inference::Termination::on_bound);
  EXPECT_EQ(fit.covariance(0, 0), 0.0);
  EXPECT_NEAR(fit.covariance(1, 1), 1.0 / fit.jacobian.col(1).squaredNorm(), 1e-9 * fit.covariance(1, 1));
  EXPECT_TRUE(fit.undetermined.empty());
}

TEST(FieldProblem, FindsTheModulusOfABaseSpecimen) {
  FieldProblem problem(simulated_case({}), small_mesh);
  const FieldFit fit = problem.fit({}, problem.start());
  EXPECT_TRUE(inference::is_settled(fit.termination));
  EXPECT_NEAR(fit.C1_kPa(), 8.0, 4.0 * fit.C1_kPa() * std::sqrt(fit.covariance(0, 0)));
  const auto rows = static_cast<double>(fit.residuals.size());
  EXPECT_NEAR(fit.chi_square, rows, 5.0 * std::sqrt(2.0 * rows));
}

}  // namespace
}  // namespace diastole::explain
