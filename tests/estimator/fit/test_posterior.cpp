#include "estimator/fit/posterior.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "estimator/fit/elastic_motion.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

/// Chains of x' = rho x + noise, stationary with unit variance.
std::vector<Eigen::VectorXd> autoregressive(double rho, Eigen::Index length, double apart = 0) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  std::vector<Eigen::VectorXd> chains;
  for (int number = 0; number < 4; ++number) {
    Eigen::VectorXd& chain = chains.emplace_back(length);
    double x = normal(generator);
    for (double& value : chain) {
      x = rho * x + std::sqrt(1 - rho * rho) * normal(generator);
      value = x + apart * number;
    }
  }
  return chains;
}

TEST(ChainDiagnostics, TellHowManyDrawsAnAutocorrelatedChainIsWorth) {
  for (const double rho : {0.0, 0.5, 0.9}) {
    const double expected = 4 * 4000 * (1 - rho) / (1 + rho);
    EXPECT_NEAR(effective_sample_size(autoregressive(rho, 4000)) / expected, 1, 0.25) << rho;
    EXPECT_LT(split_r_hat(autoregressive(rho, 4000)), 1.02);
  }
}

TEST(ChainDiagnostics, SeeChainsThatDisagree) {
  EXPECT_GT(split_r_hat(autoregressive(0.5, 1000, 1.0)), 1.2);
  EXPECT_LT(effective_sample_size(autoregressive(0.5, 1000, 1.0)), 50);
}

class CoarseFit : public testing::Test {
 protected:
  static FitOutcome fit(const FitOptions& options, EstimatedParameter estimated, double sigma_mm, size_t tags,
                        double sigma_kPa = 0.02, double noise = 1) {
    ElasticModel truth = test::coarse_gel(8.71);
    const Measurement measurement = test::synthetic(truth, {.pressures_kPa = {3.0},
                                                            .tags_a_frame = tags,
                                                            .sigma_mm = sigma_mm,
                                                            .sigma_kPa = sigma_kPa,
                                                            .noise = noise});
    ElasticMotion motion(test::coarse_gel(estimated.start), {whole_parameter(0)});
    return fit_motion(motion, {estimated}, measurement, options);
  }
};

TEST_F(CoarseFit, WherePosteriorAndProfileAreNormalTheyAgreeWithTheStandardError) {
  FitOptions options;
  options.profiled = {0};
  options.posterior.emplace();
  options.posterior->steps = 60;
  options.posterior->warm_up = 15;
  const FitOutcome outcome = fit(options, {8.0, 1.0, 50.0}, 0.3, 150);
  const EstimatedValue& C1 = outcome.values[0];
  ASSERT_EQ(outcome.profiles.size(), 1U);
  EXPECT_TRUE(outcome.profiles[0].found);
  for (size_t side = 0; side < 2; ++side) {
    EXPECT_NEAR(outcome.profiles[0].ci95[side], C1.ci95[side], 0.08 * C1.se);
    EXPECT_FALSE(outcome.profiles[0].at_bound[side]);
  }
  ASSERT_TRUE(outcome.posterior);
  const FittedPosterior& posterior = outcome.posterior->values[0];
  EXPECT_NEAR(posterior.mean, C1.value, 0.4 * C1.se);
  EXPECT_NEAR(posterior.sd / C1.se, 1, 0.25);
  EXPECT_LT(posterior.r_hat, 1.1);
  EXPECT_GT(posterior.effective_draws, 60);
  EXPECT_GT(outcome.posterior->accepted, 0.5);
  EXPECT_GE(outcome.posterior->equilibria, 240);
}

TEST_F(CoarseFit, AProfileThatTheDataDoNotEndIsEndedByItsBound) {
  FitOptions options;
  options.profiled = {0};
  const FitOutcome outcome = fit(options, {8.0, 5.0, 9.2}, 1.0, 40, 0.02, 0);
  ASSERT_EQ(outcome.profiles.size(), 1U);
  EXPECT_TRUE(outcome.profiles[0].at_bound[1]);
  EXPECT_NEAR(outcome.profiles[0].ci95[1], 9.2, 1e-9);
}

TEST_F(CoarseFit, AnOffsetOfThePressuresIsSoughtAndCostsPrecision) {
  ElasticModel truth = test::coarse_gel(8.71);
  Measurement measurement =
      test::synthetic(truth, {.pressures_kPa = {0.6, 1.8, 3.0}, .tags_a_frame = 300, .sigma_mm = 0.1});
  for (Frame& frame : measurement.frames)
    frame.pressure_kPa += 0.2;
  const auto fit_with = [&](std::optional<double> sigma_kPa) {
    ElasticMotion motion(test::coarse_gel(8), {whole_parameter(0)});
    FitOptions options;
    options.pressure_offset_sigma_kPa = sigma_kPa;
    return fit_motion(motion, {{8.0, 1.0, 15.0}}, measurement, options);
  };
  const FitOutcome without = fit_with({}), with = fit_with(0.5);
  ASSERT_TRUE(with.pressure_offset);
  EXPECT_NEAR(with.pressure_offset->value_kPa, 0.2, 3 * with.pressure_offset->se_kPa);
  EXPECT_LT(with.pressure_offset->se_kPa, 0.06);
  EXPECT_NEAR(with.values[0].value, 8.71, 3 * with.values[0].se);
  EXPECT_GT(without.values[0].value, 8.71 + 4 * without.values[0].se);
  EXPECT_GT(with.values[0].se, without.values[0].se);
  EXPECT_FALSE(without.pressure_offset);
}

TEST_F(CoarseFit, AnInterruptionKeepsTheBestSoFar) {
  FitOptions options;
  int asked = 0;
  options.search.interrupted = [&] { return ++asked > 1; };
  const FitOutcome outcome = fit(options, {2.0, 1.0, 15.0}, 0.3, 150);
  EXPECT_FALSE(outcome.converged());
  EXPECT_THAT(outcome.reason, testing::HasSubstr("Stopped on request after 1 iterations"));
  ASSERT_EQ(outcome.values.size(), 1U);
  EXPECT_GT(outcome.values[0].value, 2.5);
}

TEST_F(CoarseFit, AnInterruptedPosteriorLeavesTheFit) {
  bool asked_to_end = false;
  FitOptions options;
  options.posterior.emplace();
  options.posterior->on_step = [&](int done, int) { asked_to_end = done == 3; };
  options.search.interrupted = [&] { return asked_to_end; };
  const FitOutcome outcome = fit(options, {6.0, 1.0, 15.0}, 0.3, 40);
  EXPECT_TRUE(outcome.converged()) << outcome.reason;
  EXPECT_FALSE(outcome.posterior);
  EXPECT_EQ(outcome.interrupted, "posterior");
  ASSERT_EQ(outcome.values.size(), 1U);
  EXPECT_GT(outcome.values[0].se, 0);
}

TEST_F(CoarseFit, AnInterruptionInsideAProfileLeavesTheFit) {
  int asked = 0, last = std::numeric_limits<int>::max();
  FitOptions options;
  options.search.interrupted = [&] { return ++asked > last; };
  const FitOutcome searched = fit(options, {6.0, 1.0, 15.0}, 0.3, 40);
  ASSERT_TRUE(searched.converged()) << searched.reason;
  options.profiled = {0};
  last = asked + 3;  // asked once before the profile, then at each of its steps
  asked = 0;
  const FitOutcome profiled = fit(options, {6.0, 1.0, 15.0}, 0.3, 40);
  EXPECT_TRUE(profiled.converged()) << profiled.reason;
  EXPECT_EQ(profiled.interrupted, "profile");
  EXPECT_TRUE(profiled.profiles.empty());
  EXPECT_LE(asked, last + 4);
  EXPECT_NEAR(profiled.values[0].value, searched.values[0].value, 1e-9);
}

}  // namespace
}  // namespace diastole
