#include <gtest/gtest.h>

#include <cmath>

#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

TEST(Coverage, NinetyFivePercentIntervalsHoldTheTruthThatOften) {
  constexpr unsigned repeats = 240;
  constexpr double truth_kPa = 8.71;
  ElasticModel truth = test::coarse_gel(truth_kPa);
  unsigned held = 0;
  double pull_sum = 0, pull_squares = 0;
  for (unsigned seed = 1; seed <= repeats; ++seed) {
    const Measurement measurement =
        test::synthetic(truth, {.tags_a_frame = 100, .points_a_frame = 20, .sigma_kPa = 0.1, .seed = seed});
    const FitOutcome fit = test::fit_C1(measurement);
    ASSERT_TRUE(fit.converged) << fit.reason;
    const EstimatedValue& value = fit.values[0];
    held += value.ci95[0] <= truth_kPa && truth_kPa <= value.ci95[1] ? 1 : 0;
    const double pull = (value.value - truth_kPa) / value.se;
    pull_sum += pull;
    pull_squares += pull * pull;
  }
  const double rate = static_cast<double>(held) / repeats;
  RecordProperty("coverage", std::to_string(rate));
  EXPECT_GE(rate, 0.92);
  EXPECT_LE(rate, 0.98);
  // Normal 0.1 % tails for so many repeats.
  EXPECT_LT(std::abs(pull_sum / repeats), 0.21);
  EXPECT_NEAR(std::sqrt(pull_squares / repeats), 1.0, 0.15);
}

}  // namespace
}  // namespace diastole
