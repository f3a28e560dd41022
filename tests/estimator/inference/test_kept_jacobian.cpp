#include "estimator/inference/least_squares.hpp"
#include "estimator/inference/linear_model.hpp"
#include "tests/estimator/inference/textbook.hpp"

namespace diastole::inference {
namespace {

double one_hundredth(double) { return 0.01; }

TEST(KeptJacobian, LeadsToTheSameMinimumWithFewerSolutions) {
  const std::vector<Parameter> parameters{{"a"}, {"b"}, {"c"}};
  FunctionProblem fresh(parameters, decay({2, 0.7, 0.3}));
  FunctionProblem kept(parameters, decay({2, 0.7, 0.3}), Linearisation::kept);
  const Eigen::Vector3d start(1.8, 0.6, 0.2);
  const SearchResult exact = minimise(fresh, start, {.small_gain = one_hundredth});
  const SearchResult found = minimise(kept, start, {.small_gain = one_hundredth});
  EXPECT_EQ(found.termination, Termination::converged) << found.reason;
  EXPECT_LT(found.residuals.squaredNorm(), 0.02);
  EXPECT_LT((found.q - exact.q).norm(), 1e-3);
  EXPECT_LT(found.linearisations, exact.linearisations);
  EXPECT_LT(kept.calls, fresh.calls);
}

TEST(KeptJacobian, IsComputedAfreshWhereItMisleads) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock, Linearisation::kept);
  const SearchResult found = minimise(problem, Eigen::Vector2d(-1.2, 1.0),
                                      {.iteration_limit = 200, .small_gain = [](double) { return 1e-8; }});
  EXPECT_EQ(found.termination, Termination::converged) << found.reason;
  EXPECT_LT((found.q - Eigen::Vector2d(1, 1)).norm(), 1e-3);
  EXPECT_GT(found.linearisations, 1);
}

TEST(KeptJacobian, StaysWithinBounds) {
  FunctionProblem problem({{"a", "", 0, 1.5}, {"b", "", 0, 2}, {"c", "", -1, 1}}, decay({2, 0.7, 0.3}),
                          Linearisation::kept);
  FunctionProblem fresh({{"a", "", 0, 1.5}, {"b", "", 0, 2}, {"c", "", -1, 1}}, decay({2, 0.7, 0.3}));
  const SearchResult found = minimise(problem, Eigen::Vector3d(1, 0.4, 0), {.small_gain = one_hundredth});
  const SearchResult exact = minimise(fresh, Eigen::Vector3d(1, 0.4, 0), {.small_gain = one_hundredth});
  EXPECT_EQ(found.termination, Termination::on_bound) << found.reason;
  EXPECT_NEAR(found.residuals.squaredNorm(), exact.residuals.squaredNorm(), 0.02);
}

TEST(KeptJacobian, ExplainsWhatTheLastStepDid) {
  LinearModel model{Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 2), Eigen::Matrix2d::Identity()};
  const Eigen::Vector2d step(1, 0), there(4, 1);
  model.move_to(step, there);
  EXPECT_LT((model.jacobian * step - (there - Eigen::Vector2d(1, 2))).norm(), 1e-12);
  EXPECT_LT((model.jacobian.col(1) - Eigen::Vector2d(0, 1)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(model.kept_over_sigmas, 1.0);
}

TEST(LinearModel, ExpectsWhatALinearProblemGains) {
  LinearModel model{Eigen::Vector2d(0, 0), Eigen::Vector2d(3, 4), Eigen::Matrix2d::Identity()};
  EXPECT_DOUBLE_EQ(model.expected_gain(Eigen::Vector2d(-3, 0)), 9.0);
  EXPECT_NEAR(model.greatest_gain({false, false}), 25.0, 1e-12);
  EXPECT_NEAR(model.greatest_gain({false, true}), 9.0, 1e-12);
}

}  // namespace
}  // namespace diastole::inference
