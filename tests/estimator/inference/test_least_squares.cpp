#include "estimator/inference/least_squares.hpp"
#include "tests/estimator/inference/textbook.hpp"

namespace diastole::inference {
namespace {

TEST(LeastSquares, FollowsRosenbrocksValley) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  const SearchResult found = minimise(problem, Eigen::Vector2d(-1.2, 1.0), {});
  EXPECT_EQ(found.termination, Termination::converged);
  EXPECT_LT((found.q - Eigen::Vector2d(1, 1)).norm(), 1e-6);
  EXPECT_LT(found.cost(), 1e-12);
  EXPECT_EQ(found.jacobian.rows(), 2);
}

TEST(LeastSquares, FollowsTheValleyAlongABound) {
  FunctionProblem problem({{"x", "", -2, 0.5}, {"y", "", -2, 2}}, rosenbrock);
  const SearchResult found = minimise(problem, Eigen::Vector2d(-1.2, 1.0), {});
  EXPECT_EQ(found.termination, Termination::on_bound);
  EXPECT_TRUE(is_settled(found.termination));
  EXPECT_EQ(found.pressed, (std::vector{true, false}));
  EXPECT_NEAR(found.q[0], 0.5, 1e-9);
  EXPECT_NEAR(found.q[1], 0.25, 1e-5);
}

TEST(LeastSquares, EndsWhereTheJacobianIsSingular) {
  FunctionProblem problem({{"a"}, {"b"}, {"c"}, {"d"}}, powell);
  const SearchResult found = minimise(problem, Eigen::Vector4d(3, -1, 0, 1), {});
  EXPECT_TRUE(is_settled(found.termination)) << found.reason;
  EXPECT_LT(found.q.norm(), 0.05);
}

TEST(LeastSquares, KeepsHeldUnknowns) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  const SearchResult found = minimise(problem, Eigen::Vector2d(0.3, 1.0), {.held = {true, false}});
  EXPECT_EQ(found.termination, Termination::converged);
  EXPECT_EQ(found.q[0], 0.3);
  EXPECT_NEAR(found.q[1], 0.09, 1e-8);
}

TEST(LeastSquares, GoesAroundPointsWithoutASolution) {
  const auto nothing_above = [](const Eigen::VectorXd& q) -> std::optional<Eigen::VectorXd> {
    if (q[0] > 3.0) return {};
    return Eigen::VectorXd::Constant(1, q[0] * q[0] - 4.0);  // from 0.2 the full step leads to 10
  };
  FunctionProblem problem({{"x"}}, nothing_above);
  int refused = 0;
  SearchOptions options;
  options.on_step = [&](const SearchStep& step) { refused += step.accepted ? 0 : 1; };
  const SearchResult found = minimise(problem, Eigen::VectorXd::Constant(1, 0.2), options);
  EXPECT_EQ(found.termination, Termination::converged);
  EXPECT_NEAR(found.q[0], 2.0, 1e-6);
  EXPECT_GT(refused, 1);
}

TEST(LeastSquares, StaysWithinTheLongestStep) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  Eigen::VectorXd before = Eigen::Vector2d(-1.2, 1.0);
  SearchOptions options;
  options.iteration_limit = 200;
  options.longest_step = Eigen::Vector2d(0.1, 1.0);
  options.on_step = [&](const SearchStep& step) {
    EXPECT_LT(std::abs(step.q[0] - before[0]), 0.1 + 1e-12);
    before = step.q;
  };
  const SearchResult found = minimise(problem, before, options);
  EXPECT_EQ(found.termination, Termination::converged);
  EXPECT_LT((found.q - Eigen::Vector2d(1, 1)).norm(), 1e-5);
}

TEST(LeastSquares, EndsWhenLittleIsToBeGained) {
  FunctionProblem exact({{"a"}, {"b"}, {"c"}}, decay({2, 0.7, 0.3}));
  FunctionProblem rough({{"a"}, {"b"}, {"c"}}, decay({2, 0.7, 0.3}));
  const Eigen::Vector3d start(1, 0.4, 0);
  const SearchResult best = minimise(exact, start, {});
  const SearchResult found = minimise(rough, start, {.small_gain = [](double) { return 0.01; }});
  EXPECT_EQ(found.termination, Termination::converged);
  EXPECT_LT(found.residuals.squaredNorm(), 0.01);
  EXPECT_LT(found.evaluations, best.evaluations);
}

TEST(LeastSquares, EndsAsStalledWhereTenStepsBringNextToNothing) {
  // Its Jacobian is two hundred times too steep: each step is so much too short, and much is expected of all.
  class TooSteep : public FunctionProblem {
   public:
    using FunctionProblem::FunctionProblem;
    Eigen::MatrixXd jacobian(const Eigen::VectorXd&) override {
      return Eigen::MatrixXd::Constant(1, 1, 200.0);
    }
  };
  TooSteep problem({{"x"}}, [](const Eigen::VectorXd& q) { return std::optional(q); });
  const SearchOptions options{
      .iteration_limit = 1000, .small_gain = [](double) { return 1.0; }, .first_radius = 1};
  const SearchResult found = minimise(problem, Eigen::VectorXd::Constant(1, 3.0), options);
  EXPECT_EQ(found.termination, Termination::stalled);
  EXPECT_EQ(found.iterations, 10);
}

TEST(LeastSquares, ReportsEachStepOnce) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  std::vector<int> iterations;
  SearchOptions options;
  options.longest_step = Eigen::Vector2d(1, 1);  // many rounds
  options.on_step = [&](const SearchStep& step) { iterations.push_back(step.iteration); };
  const SearchResult found = minimise(problem, Eigen::Vector2d(-1.2, 1.0), options);
  ASSERT_EQ(found.iterations + 1, static_cast<int>(iterations.size()));
  for (size_t i = 0; i < iterations.size(); ++i)
    EXPECT_EQ(iterations[i], static_cast<int>(i));
}

}  // namespace
}  // namespace diastole::inference
