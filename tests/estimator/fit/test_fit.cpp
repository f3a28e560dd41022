#include <gmock/gmock.h>

#include <cmath>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/fit/fit.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

using test::coarse_gel;
using test::fit_C1;
using test::synthetic;
using test::SyntheticOptions;
using testing::HasSubstr;

constexpr double truth_kPa = 8.71;

Measurement measured(const SyntheticOptions& options) {
  ElasticModel truth = coarse_gel(truth_kPa);
  return synthetic(truth, options);
}

TEST(JointProblem, UnknownsHaveUnitsAndPositiveOnesAreSearchedByTheirLogarithm) {
  ElasticMotion motion(coarse_gel(8), {whole_parameter(0)});
  const JointProblem problem(motion, {{7.0, 1.0, 15.0, "C1_kPa", "kPa"}}, measured({.tags_a_frame = 40}), {});
  EXPECT_EQ(problem.space()[0].scale, inference::Scale::logarithmic);
  for (Eigen::Index i = 0; i < problem.space().size(); ++i)
    EXPECT_EQ(problem.space()[i].unit, "kPa") << problem.space()[i].name;
  EXPECT_EQ(EstimatedParameter(0.0, -1.0, 1.0).scale, inference::Scale::linear);
}

TEST(JointProblem, TheJacobianIsTheResidualsDerivative) {
  Measurement measurement = measured({.tags_a_frame = 40, .points_a_frame = 10});
  measurement.planes_as_seen = true;
  ElasticMotion motion(coarse_gel(8), each_element(0, 8));
  JointProblem problem(motion, std::vector<EstimatedParameter>(8, {7.0, 1.0, 15.0}), measurement, {});
  const Eigen::VectorXd q = problem.start();
  ASSERT_TRUE(problem.find_points(q));
  ASSERT_TRUE(problem.residuals(q));
  const Eigen::MatrixXd jacobian = problem.jacobian(q);
  const Eigen::Index planes = 4 * TagPlanes::of_a_set;
  ASSERT_EQ(jacobian.cols(), 8 + 2 + planes);
  ASSERT_EQ(jacobian.rows(), 2 * (40 + 3 * 10) + 2 + planes);
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    const double h = 1e-4;
    const auto at = [&](double shift) {
      Eigen::VectorXd moved = q;
      moved[k] += shift;
      const std::optional<Eigen::VectorXd> residuals = problem.residuals(moved);
      return residuals.value();
    };
    const Eigen::VectorXd difference = (at(h) - at(-h)) / (2 * h);
    EXPECT_LT((difference - jacobian.col(k)).norm(), 1e-5 * (1 + jacobian.col(k).norm())) << "unknown " << k;
  }
}

TEST(Fit, FindsTagPlanesAnewThatWereSeenInImages) {
  // A first phase at rest, and planes whose distance is off by a thousandth, as a first phase may show it.
  Measurement measurement = measured(
      {.pressures_kPa = {0.001, 1.5, 3.0}, .tags_a_frame = 300, .sigma_mm = 0.03, .sigma_kPa = 0.002});
  for (TagPoint& tag : measurement.tags)
    tag.plane_mm *= 1.001;
  const EstimatedValue as_they_stand = fit_C1(measurement).values[0];
  EXPECT_GT(std::abs(as_they_stand.value - truth_kPa), 5 * as_they_stand.se);
  measurement.planes_as_seen = true;
  const EstimatedValue anew = fit_C1(measurement).values[0];
  EXPECT_LT(std::abs(anew.value - truth_kPa), 3 * anew.se);
  EXPECT_LT(anew.se, 3 * as_they_stand.se);
}

TEST(Fit, GivesBackTheTruthWithoutNoiseFromFarStarts) {
  for (const double start : {1.5, 14.0}) {
    for (const bool tags : {true, false}) {
      const Measurement measurement =
          measured({.tags_a_frame = tags ? 100U : 0U, .points_a_frame = tags ? 0U : 50U, .noise = 0});
      const FitOutcome fit = fit_C1(measurement, {start, 1.0, 15.0});
      EXPECT_TRUE(fit.converged()) << fit.reason;
      EXPECT_THAT(fit.reason, HasSubstr("Converged"));
      ASSERT_EQ(fit.values.size(), 1U);
      EXPECT_NEAR(fit.values[0].value, truth_kPa, 1e-5) << "start " << start << (tags ? " tags" : " points");
      EXPECT_LT(fit.chi2, 1e-8);
      EXPECT_LT(fit.iterations, 12);
    }
  }
}

TEST(Fit, GivesBackRegionalValuesWithoutNoise) {
  ElasticModel truth = coarse_gel(8);
  std::vector<double> values;
  for (size_t e = 0; e < truth.mesh().element_count(); ++e) {
    values.push_back(8.0 + std::sin(1.0 + static_cast<double>(e)));
    truth.set_element_parameter(0, e, values.back());
  }
  const Measurement measurement = synthetic(truth, {.tags_a_frame = 300, .noise = 0});
  ElasticMotion motion(coarse_gel(6), each_element(0, values.size()));
  const FitOutcome fit =
      fit_motion(motion, std::vector<EstimatedParameter>(values.size(), {6.0, 1.0, 20.0}), measurement, {});
  EXPECT_TRUE(fit.converged()) << fit.reason;
  for (size_t e = 0; e < values.size(); ++e)
    EXPECT_NEAR(fit.values[e].value, values[e], 1e-3) << "element " << e;
}

// In a neo-Hookean body the motion depends on P / C1 alone. With one frame the pressure's relative error
// therefore adds to that of C1 in quadrature, whatever the imaging: se² = se_exact² + (C1 sigma_P / P)².
TEST(Fit, ThePressuresErrorWidensTheIntervalAsTheorySays) {
  SyntheticOptions options{.pressures_kPa = {3.0}, .tags_a_frame = 400, .noise = 0};
  for (const double sigma_kPa : {0.02, 0.1, 0.3}) {
    options.sigma_kPa = sigma_kPa;
    const FitOutcome fit = fit_C1(measured(options));
    const double theory =
        std::hypot(fit.values[0].se_exact_pressure, truth_kPa * sigma_kPa / options.pressures_kPa[0]);
    EXPECT_NEAR(fit.values[0].se / theory, 1.0, 1e-4) << "sigma " << sigma_kPa;
  }
}

TEST(Fit, ThePressuresShareIsWhatExactOnesWouldTakeAway) {
  SyntheticOptions options{.sigma_kPa = 0.1, .noise = 0};
  const EstimatedValue with = fit_C1(measured(options)).values[0];
  options.sigma_kPa = 0;
  const EstimatedValue exact = fit_C1(measured(options)).values[0];
  ASSERT_TRUE(with.shares && exact.shares);
  EXPECT_GT(with.shares->pressures, 0.2);
  EXPECT_NEAR(with.shares->pressures, 1 - std::pow(exact.se / with.se, 2), 1e-3);
  EXPECT_NEAR(exact.shares->pressures, 0, 1e-9);
}

TEST(Fit, ResidualsThatAreAlikeAreNotThePressures) {
  Measurement measurement = measured({.tags_a_frame = 300, .sigma_kPa = 0});
  for (TagPoint& tag : measurement.tags) {  // a plane's tags are off together, otherwise in each frame
    for (size_t k = 0; k < 3; ++k)
      tag.x_mm[k] += 0.4 * tag.normal[k] * std::cos(3.0 * tag.plane_mm + 2.0 * tag.frame);
  }
  measurement.planes_as_seen = true;
  const FitOutcome fit = fit_C1(measurement);
  EXPECT_GT(fit.alike, 1.2);
  ASSERT_TRUE(fit.values[0].shares);
  EXPECT_NEAR(fit.values[0].shares->pressures, 0, 1e-9);
  EXPECT_NEAR(fit.values[0].shares->images, 1, 1e-9);
  EXPECT_NEAR(fit.values[0].se_exact_pressure / fit.values[0].se, 1, 1e-9);
}

TEST(Fit, AnExactPressureIsNotAnUnknown) {
  const FitOutcome fit = fit_C1(measured({.sigma_kPa = 0}));
  EXPECT_EQ(fit.covariance.rows(), 1);
  EXPECT_DOUBLE_EQ(fit.values[0].se, fit.values[0].se_exact_pressure);
  EXPECT_EQ(fit.frames[0].pressure_kPa, 1.5);
  EXPECT_EQ(fit.frames[0].se_kPa, 0);
}

TEST(Fit, EstimatesScatterAsTheirErrorsSay) {
  constexpr unsigned repeats = 8;
  double squares = 0, chi2_per_dof = 0;
  for (unsigned seed = 1; seed <= repeats; ++seed) {
    const FitOutcome fit = fit_C1(measured({.seed = seed}));
    ASSERT_TRUE(fit.converged()) << fit.reason;
    squares += std::pow((fit.values[0].value - truth_kPa) / fit.values[0].se, 2);
    chi2_per_dof += fit.chi2 / (static_cast<double>(fit.rows) - fit.unknowns) / repeats;
  }
  // 0.1 % tails of chi-square with 8 degrees of freedom.
  EXPECT_GT(squares, 0.86);
  EXPECT_LT(squares, 26.1);
  EXPECT_NEAR(chi2_per_dof, 1.0, 0.15);
}

TEST(Fit, AValueOnItsBoundIsSaidToBeThere) {
  const FitOutcome fit = fit_C1(measured({}), {5.0, 1.0, 7.0});
  EXPECT_NEAR(fit.values[0].value, 7.0, 1e-6);
  EXPECT_TRUE(fit.values[0].at_upper);
  EXPECT_FALSE(fit.values[0].at_lower);
  EXPECT_TRUE(std::isnan(fit.values[0].se));
  EXPECT_TRUE(std::isnan(fit.values[0].ci95[0]));
}

TEST(Fit, PointsOffTheBodyAreLeftOutAndCounted) {
  Measurement measurement = measured({});
  TagPoint stray = measurement.tags.back();
  stray.x_mm = {150, 0, 0};
  measurement.tags.push_back(stray);
  measurement.points.push_back({1, {0, 0, 0}, {1, 0, 0}, 0.3});  // the cavity is no material
  const FitOutcome fit = fit_C1(measurement);
  EXPECT_EQ(fit.frames.back().found.tags_left_out, 1U);
  EXPECT_EQ(fit.frames.front().found.points_left_out, 1U);
  EXPECT_NEAR(fit.values[0].value, truth_kPa, 5 * fit.values[0].se);
}

TEST(Fit, StopsAtTheIterationLimitAndSaysSo) {
  ElasticMotion motion(coarse_gel(2), {whole_parameter(0)});
  FitOptions options;
  options.search.iteration_limit = 1;
  const FitOutcome fit = fit_motion(motion, {{2.0, 1.0, 15.0}}, measured({}), options);
  EXPECT_FALSE(fit.converged());
  EXPECT_THAT(fit.reason, HasSubstr("limit of 1 iterations"));
  EXPECT_EQ(fit.iterations, 1);
}

/// To the bit: a frame's result depends on neither the thread nor the frames beside it.
TEST(Fit, FramesAtTheSameTimeAreThoseOneAfterAnother) {
  const std::vector<double> start(8, 8.0), later{8.2, 7.9, 8.4, 7.7, 8.1, 8.0, 7.6, 8.3};
  const std::vector<double> pressures_kPa{0.6, 1.2, 1.8, 2.4, 3.0};
  ElasticMotion at_once(coarse_gel(8), each_element(0, 8)), in_turn(coarse_gel(8), each_element(0, 8));
  for (const std::vector<double>& values : {start, later}) {
    const std::vector<MotionOutcome> outcomes = at_once.solve_all(values, pressures_kPa);
    ASSERT_EQ(outcomes.size(), pressures_kPa.size());
    for (size_t slot = 0; slot < pressures_kPa.size(); ++slot) {
      const MotionOutcome alone = in_turn.solve(slot, values, pressures_kPa[slot]);
      EXPECT_EQ(outcomes[slot].position_mm.value(), alone.position_mm.value());
    }
    at_once.prepare_derivatives();
    for (size_t slot = 0; slot < pressures_kPa.size(); ++slot) {
      const MotionDerivatives together = at_once.derivatives(slot), alone = in_turn.derivatives(slot);
      EXPECT_EQ(together.by_value, alone.by_value);
      EXPECT_EQ(together.by_pressure, alone.by_pressure);
    }
  }
}

/// A body without equilibrium.
class NoMotion : public MotionModel {
 public:
  [[nodiscard]] const HermiteMesh& mesh() const override { return model_.mesh(); }
  [[nodiscard]] MotionOutcome solve(size_t, std::span<const double>, double) override {
    return {std::nullopt, "it bursts"};
  }
  [[nodiscard]] MotionDerivatives derivatives(size_t) override { return {}; }

 private:
  ElasticModel model_ = coarse_gel(8);
};

TEST(Fit, AModelWithoutEquilibriumIsAnOutcomeWithItsReason) {
  NoMotion motion;
  const FitOutcome fit = fit_motion(motion, {{6.0, 1.0, 15.0}}, measured({}), {});
  EXPECT_FALSE(fit.converged());
  EXPECT_THAT(fit.reason, testing::AllOf(HasSubstr("frame 1"), HasSubstr("it bursts")));
  EXPECT_TRUE(fit.values.empty());
}

}  // namespace
}  // namespace diastole
