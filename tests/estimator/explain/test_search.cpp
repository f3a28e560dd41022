#include <gtest/gtest.h>

#include "estimator/explain/rig/search.hpp"
#include "estimator/rig_fit/linear_basis.hpp"

namespace diastole::explain {
namespace {

TEST(Screening, GainIsWhatAFitOverBothTakesOffBeyondTheKnown) {
  Eigen::MatrixXd known(4, 1);
  known << 1, 1, 0, 0;
  Eigen::MatrixXd column(4, 1);
  column << 1, 0, 1, 0;
  const Eigen::Vector4d residuals(3, 1, 2, 5);
  // Beyond (1,1,0,0) the column is (1/2, -1/2, 1, 0): its part of the residuals is 3 / sqrt(3/2).
  EXPECT_NEAR(linear_gain(rig::basis_of(known), column, residuals), 6.0, 1e-12);
  EXPECT_NEAR(linear_gain(rig::basis_of(known), known, residuals), 0.0, 1e-12);
}

TEST(Screening, DependentColumnsAreLeftOut) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Random(20, 3);
  columns.col(2) = columns.col(0) - 2.0 * columns.col(1);
  EXPECT_EQ(rig::basis_of(columns).cols(), 2);
}

TEST(Search, FollowsTheBestSetHoweverLowItLies) {
  EXPECT_TRUE(worth_following(0.9, 0.9));
  EXPECT_TRUE(worth_following(1.4, 1.4));
  EXPECT_TRUE(worth_following(1.3, 1.1));
  EXPECT_FALSE(worth_following(1.5, 1.1));
  EXPECT_FALSE(worth_following(1.02, 0.99));
}

TEST(Search, GivesUpWhereTheBestLeavesMostOfAPlainMisfit) {
  const auto set = [](double chi_square) {
    FittedSet made;
    made.fit.count = 1000;
    made.fit.chi_square = made.chi_square = chi_square;
    return made;
  };
  EXPECT_TRUE(leaves_misfit(set(5000.0), set(2000.0)));
  EXPECT_FALSE(leaves_misfit(set(5000.0), set(1200.0)));   // close to the noise
  EXPECT_FALSE(leaves_misfit(set(50000.0), set(2000.0)));  // most of it is found
}

}  // namespace
}  // namespace diastole::explain
