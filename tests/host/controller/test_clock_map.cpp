#include "host/controller/clock_map.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace diastole {
namespace {

/// Pairs every 250 ms of two clocks that differ by `ppm`, with answers delayed up to 0.2 ms.
std::vector<ClockPair> pairs_over(double span_s, double ppm, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> delay_s(0, 2e-4);
  std::vector<ClockPair> pairs;
  for (double t = 0; t < span_s; t += 0.25) {
    const double half_s = 1e-4 + delay_s(random) / 2;
    pairs.push_back({5000 + t, 77 + t * (1 + 1e-6 * ppm) + delay_s(random) - 1e-4, half_s});
  }
  return pairs;
}

TEST(ClockMap, FindsOffsetAndDrift) {
  const auto map = fit_clock_map(pairs_over(600, 43, 1));
  ASSERT_TRUE(map);
  EXPECT_NEAR(map->drift_ppm(), 43, 0.2);
  EXPECT_NEAR(map->to_other_s(5000), 77, 2e-5);
  EXPECT_NEAR(map->to_host_s(map->to_other_s(5123.4)), 5123.4, 1e-9);
  EXPECT_LT(map->residual_s, 2e-4);
}

TEST(ClockMap, OneFifthOfWildPairsChangesNothing) {
  std::vector<ClockPair> pairs = pairs_over(120, -80, 2);
  const auto clean = fit_clock_map(pairs);
  std::mt19937 random(3);
  size_t spoilt = 0;
  for (ClockPair& pair : pairs) {
    if (random() % 5 != 0) continue;
    pair.other_s += 0.01 + 1e-4 * static_cast<double>(random() % 1000);  // late answers, all to one side
    ++spoilt;
  }
  const auto robust = fit_clock_map(pairs);
  ASSERT_TRUE(clean && robust);
  EXPECT_GE(robust->pairs_dropped, spoilt);
  EXPECT_NEAR(robust->drift_ppm(), clean->drift_ppm(), 0.5);
  EXPECT_NEAR(robust->to_other_s(5060), clean->to_other_s(5060), 2e-5);
}

TEST(ClockMap, AShortSessionFixesTheOffsetOnly) {
  const auto map = fit_clock_map(pairs_over(0.6, 500, 4));
  ASSERT_TRUE(map);
  EXPECT_DOUBLE_EQ(map->scale, 1);
  EXPECT_NEAR(map->to_other_s(5000.3), 77.3, 3e-4);
}

TEST(ClockMap, WithoutPairsThereIsNoMap) { EXPECT_FALSE(fit_clock_map({})); }

TEST(ClockMap, OnePairIsAnOffset) {
  const std::vector<ClockPair> one{{10, 20, 1e-3}};
  const auto map = fit_clock_map(one);
  ASSERT_TRUE(map);
  EXPECT_DOUBLE_EQ(map->to_other_s(11), 21);
}

}  // namespace
}  // namespace diastole
