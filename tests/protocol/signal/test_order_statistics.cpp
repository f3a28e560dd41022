#include <gtest/gtest.h>

#include "protocol/signal/median.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::signal {
namespace {

TEST(OrderStatistics, AQuantileIsTheLowerOfTwoNeighbours) {
  EXPECT_EQ(quantile(std::vector<double>{}, 0.5), 0.0);
  EXPECT_EQ(quantile(std::vector{7.0}, 0.98), 7.0);
  EXPECT_EQ(quantile(std::vector{2.0, 1.0}, 0.5), 1.0);
  const std::vector<double> five{50.0, 10.0, 40.0, 20.0, 30.0};
  EXPECT_EQ(quantile(five, 0.0), 10.0);
  EXPECT_EQ(quantile(five, 0.5), 30.0);
  EXPECT_EQ(quantile(five, 0.99), 40.0);
  EXPECT_EQ(quantile(five, 1.0), 50.0);
  EXPECT_EQ(quantile_of_sorted(std::vector{10.0, 20.0, 30.0, 40.0, 50.0}, 0.74), 30.0);
}

TEST(OrderStatistics, TheMedianOfAnEvenNumberIsTheUpperOfTheTwoInTheMiddle) {
  EXPECT_EQ(median(std::vector{4.0, 1.0, 3.0, 2.0}), 3.0);
  EXPECT_DOUBLE_EQ(deviation_of_normal({1.0, 2.0, 100.0}), 1.4826 * 2.0);
}

}  // namespace
}  // namespace diastole::signal
