#include "estimator/fit/robust_loss.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "estimator/fit/elastic_motion.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

TEST(RobustLoss, ItsDerivativesAreThoseOfItsFormula) {
  const RobustLoss loss{0.8};
  for (const double r : {-30.0, -2.0, -1e-3, 0.5, 1.0, 7.0}) {
    const double h = 1e-5 * std::max(1.0, std::abs(r));
    EXPECT_NEAR(loss.slope(r), (loss.residual(r + h) - loss.residual(r - h)) / (2 * h), 1e-7);
    EXPECT_NEAR(loss.influence(r), loss.residual(r) * loss.slope(r), 1e-12);
    EXPECT_NEAR(loss.influence_slope(r), (loss.influence(r + h) - loss.influence(r - h)) / (2 * h), 1e-7);
  }
  EXPECT_DOUBLE_EQ(loss.residual(0), 0);
  EXPECT_NEAR(loss.slope(0), loss.slope(1e-8), 1e-6);
}

TEST(RobustLoss, TheScaleIsThatOfTheCore) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  Eigen::VectorXd clean(4000);
  for (double& r : clean)
    r = 2 * normal(generator);
  Eigen::VectorXd wild = clean;
  for (Eigen::Index i = 0; i < wild.size(); i += 20)
    wild[i] = 100 * normal(generator);
  EXPECT_NEAR(core_deviation(clean), 2, 0.1);
  EXPECT_NEAR(core_deviation(wild), 2, 0.2);
  // The greatest likelihood of t on normal residuals: the mean of psi r is 1 there.
  const RobustLoss loss = RobustLoss::for_deviation(2);
  double sum = 0;
  for (const double r : clean)
    sum += loss.influence(r) * r / 4000;
  EXPECT_NEAR(sum, 1, 0.03);
  EXPECT_EQ(wild_count(clean), 0);
  EXPECT_NEAR(static_cast<double>(wild_count(wild)), 185, 15);
}

class WildPoints : public testing::Test {
 protected:
  /// Every `nth` tag point is thrown along its normal by up to 15 mm.
  static Measurement measured(size_t nth, unsigned seed) {
    ElasticModel truth = test::coarse_gel(8.71);
    Measurement measurement = test::synthetic(truth, {.tags_a_frame = 300, .seed = seed});
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> throw_mm(0, 15);  // to one side: normal loss is biased by it
    for (size_t i = 0; nth > 0 && i < measurement.tags.size(); i += nth) {
      TagPoint& tag = measurement.tags[i];
      const double sign = tag.x_mm[0] * tag.normal[0] + tag.x_mm[1] * tag.normal[1] > 0 ? 1 : -1;
      const double mm = sign * throw_mm(generator);
      for (size_t k = 0; k < 3; ++k)
        tag.x_mm[k] += mm * tag.normal[k];
    }
    return measurement;
  }
  static FitOutcome fit(const Measurement& measurement, Robustness robustness, int most_searches = 8) {
    ElasticMotion motion(test::coarse_gel(6), {whole_parameter(0)});
    FitOptions options;
    options.robustness = robustness;
    options.most_searches = most_searches;
    return fit_motion(motion, {{6.0, 1.0, 15.0}}, measurement, options);
  }
};

TEST_F(WildPoints, FivePerCentOfThemDoNotMoveTheStiffness) {
  for (const unsigned seed : {1U, 2U}) {
    const double clean = fit(measured(0, seed), Robustness::never).values[0].value;
    const FitOutcome found = fit(measured(20, seed), Robustness::if_needed);
    ASSERT_TRUE(found.converged()) << found.reason;
    ASSERT_TRUE(found.robust);
    EXPECT_NEAR(found.values[0].value / clean, 1, 0.02);
    EXPECT_NEAR(found.values[0].value, 8.71, 3 * found.values[0].se);
    EXPECT_GT(std::abs(fit(measured(20, seed), Robustness::never).values[0].value / clean - 1), 0.05);
  }
}

TEST_F(WildPoints, ALossThatWasChosenAfterTheLastSearchLeavesTheFitUnfinished) {
  const FitOutcome found = fit(measured(20, 1), Robustness::if_needed, 1);
  EXPECT_EQ(found.termination, inference::Termination::iteration_limit);
  EXPECT_TRUE(found.reason.starts_with("Stopped after 1 searches")) << found.reason;
  EXPECT_TRUE(fit(measured(0, 1), Robustness::if_needed, 1).converged());
}

/// Tags in three frames, each with a probability of 5 % thrown by up to `most_mm` along every axis: many of them
/// end near the body's surface, where some motions lose them.
Measurement thrown_about(double most_mm, unsigned seed) {
  ElasticModel truth = test::coarse_gel(8.71);
  Measurement measurement = test::synthetic(
      truth, {.pressures_kPa = {1.0, 2.0, 3.0}, .tags_a_frame = 700, .sigma_mm = 0.8, .seed = seed});
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> chance(0, 1), throw_mm(-most_mm, most_mm);
  for (TagPoint& tag : measurement.tags) {
    if (chance(generator) > 0.05) continue;
    for (double& x_mm : tag.x_mm)
      x_mm += throw_mm(generator);
  }
  return measurement;
}

TEST_F(WildPoints, ThrownInAllDirectionsTheyNeitherMoveNorStopTheFit) {
  for (const double most_mm : {20.0, 40.0}) {
    for (const unsigned seed : {2U, 3U}) {
      SCOPED_TRACE(testing::Message() << "up to " << most_mm << " mm, seed " << seed);
      const Measurement measurement = thrown_about(most_mm, seed);
      const FitOutcome found = fit(measurement, Robustness::if_needed);
      ASSERT_TRUE(found.converged()) << found.reason;
      EXPECT_TRUE(found.robust);
      EXPECT_LT(found.iterations, 30);
      EXPECT_NEAR(found.values[0].value, 8.71, 3 * found.values[0].se);
      EXPECT_LT(found.values[0].se, 0.3);
    }
  }
}

TEST_F(WildPoints, CleanDataCostLittleAndAreLeftToTheNormalLoss) {
  const Measurement measurement = measured(0, 1);
  const FitOutcome normal = fit(measurement, Robustness::if_needed),
                   robust = fit(measurement, Robustness::always);
  EXPECT_FALSE(normal.robust);
  ASSERT_TRUE(robust.robust);
  EXPECT_EQ(robust.robust->wild, 0);
  EXPECT_NEAR(robust.values[0].value, normal.values[0].value, normal.values[0].se);
  EXPECT_NEAR(robust.values[0].se / normal.values[0].se, 1.04, 0.06);
}

TEST_F(WildPoints, ASigmaStatedTooSmallIsMended) {
  Measurement measurement = measured(0, 1);
  for (TagPoint& tag : measurement.tags)
    tag.sigma_mm /= 10;
  const FitOutcome robust = fit(measurement, Robustness::always);
  const double honest = fit(measured(0, 1), Robustness::never).values[0].se;
  EXPECT_NEAR(robust.values[0].se / honest, 1.04, 0.1);
}

}  // namespace
}  // namespace diastole
