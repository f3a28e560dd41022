// Against closed forms and printed tables.

#include "estimator/inference/tail_probability.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/inference/intervals.hpp"

namespace diastole::inference {
namespace {

TEST(TailProbability, OfChiSquare) {
  EXPECT_NEAR(chi_square_tail(3.0, 2.0), std::exp(-1.5), 1e-15) << "twice an exponential variable";
  EXPECT_NEAR(chi_square_tail(7.7794, 4.0), 0.1, 1e-5);
  EXPECT_NEAR(chi_square_tail(normal_95 * normal_95, 1.0), 0.05, 1e-12);
  EXPECT_EQ(chi_square_tail(0.0, 3.0), 1.0);
  EXPECT_EQ(chi_square_tail(-2.0, 3.0), 1.0);
}

TEST(TailProbability, OfTheNormalLaw) {
  EXPECT_EQ(normal_tail(0.0), 0.5);
  EXPECT_NEAR(normal_tail(normal_95), 0.025, 1e-12);
  EXPECT_NEAR(normal_tail(-normal_90), 0.95, 1e-12);
}

TEST(TailProbability, TheLargestDiscoveryCarriesThoseBelowIt) {
  // Sorted 0.01, 0.035, 0.039, 0.2 against 0.0125, 0.025, 0.0375, 0.05, and against twice as much.
  const std::vector<double> p_values{0.2, 0.01, 0.039, 0.035};
  EXPECT_EQ(discovery_limit(p_values, 0.05), 0.01);
  EXPECT_EQ(discovery_limit(p_values, 0.1), 0.039);
  EXPECT_EQ(discovery_limit(p_values, 0.01), 0.0);
}

}  // namespace
}  // namespace diastole::inference
