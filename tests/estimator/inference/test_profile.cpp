#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/profile.hpp"
#include "tests/estimator/inference/textbook.hpp"

namespace diastole::inference {
namespace {

std::array<ProfileEnd, 2> profile(FunctionProblem& problem, const Eigen::VectorXd& start,
                                  Eigen::Index which) {
  const SearchResult best = minimise(problem, start, {});
  EXPECT_TRUE(is_settled(best.termination));
  return profile_interval({problem, best.q, estimate_covariance(best.jacobian).matrix, best.cost()}, which);
}

std::optional<Eigen::VectorXd> plane(const Eigen::VectorXd& q) {
  return Eigen::Vector3d(q[0] + q[1] - 3, q[0] - q[1] + 1, 2 * q[1] - 4);
}

TEST(Profile, IsTheNormalIntervalOfALinearProblem) {
  FunctionProblem problem({{"a"}, {"b"}}, plane);
  const auto ends = profile(problem, Eigen::Vector2d(0, 0), 0);
  const double half = normal_95 * std::sqrt(0.5);
  for (size_t side = 0; side < 2; ++side) {
    EXPECT_TRUE(ends[side].found);
    EXPECT_FALSE(ends[side].at_bound);
    EXPECT_NEAR(ends[side].coordinate, 1.0 + (side == 0 ? -half : half), 0.01 * half);
  }
}

TEST(Profile, EndsAtABound) {
  FunctionProblem problem({{"a", "", -5, 1.5}, {"b"}}, plane);
  const auto ends = profile(problem, Eigen::Vector2d(0, 0), 0);
  EXPECT_FALSE(ends[0].at_bound);
  EXPECT_TRUE(ends[1].at_bound);
  EXPECT_EQ(ends[1].coordinate, 1.5);
}

TEST(Profile, IsLopsidedWhereTheLikelihoodIs) {
  // exp(a) is measured to be 3 with a standard deviation of 1.
  FunctionProblem problem({{"a"}}, [](const Eigen::VectorXd& q) -> std::optional<Eigen::VectorXd> {
    return Eigen::VectorXd::Constant(1, std::exp(q[0]) - 3);
  });
  const auto ends = profile(problem, Eigen::VectorXd::Zero(1), 0);
  EXPECT_NEAR(ends[0].coordinate, std::log(3 - normal_95), 0.02);
  EXPECT_NEAR(ends[1].coordinate, std::log(3 + normal_95), 0.02);
}

}  // namespace
}  // namespace diastole::inference
