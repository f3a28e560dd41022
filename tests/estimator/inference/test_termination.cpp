// Each way in which a search ends, forced once.

#include "estimator/inference/least_squares.hpp"
#include "tests/estimator/inference/textbook.hpp"

namespace diastole::inference {
namespace {

const Eigen::Vector2d usual_start(-1.2, 1.0);

TEST(Termination, Converged) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  const SearchResult found = minimise(problem, usual_start, {});
  EXPECT_EQ(found.termination, Termination::converged);
  EXPECT_THAT(found.reason, testing::StartsWith("Converged: "));
}

TEST(Termination, OnBound) {
  FunctionProblem problem({{"x", "", -2, 0.5}, {"y"}}, rosenbrock);
  EXPECT_EQ(minimise(problem, usual_start, {}).termination, Termination::on_bound);
}

TEST(Termination, AHeldUnknownOnItsBoundIsNoObstacle) {
  FunctionProblem problem({{"x", "", -2, 0.5}, {"y"}}, rosenbrock);
  EXPECT_EQ(minimise(problem, Eigen::Vector2d(0.5, 1), {.held = {true, false}}).termination,
            Termination::converged);
}

TEST(Termination, Stalled) {
  // A slope everywhere, and a jump upwards all around the start.
  const auto jump = [](const Eigen::VectorXd& q) -> std::optional<Eigen::VectorXd> {
    return Eigen::VectorXd::Constant(1, std::abs(q[0]) < 1e-5 ? 10 - q[0] : 20 - q[0]);
  };
  FunctionProblem problem({{"x"}}, jump);
  const SearchResult found = minimise(problem, Eigen::VectorXd::Zero(1), {});
  EXPECT_EQ(found.termination, Termination::stalled);
  EXPECT_EQ(found.reason, "Failed: the cost has a slope, but no step lowers it.");
  FunctionProblem again({{"x"}}, jump);
  const SearchResult given_up = minimise(again, Eigen::VectorXd::Zero(1), {.refusal_limit = 3});
  EXPECT_EQ(given_up.termination, Termination::stalled);
  EXPECT_EQ(given_up.iterations, 3);
}

TEST(Termination, IterationLimit) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  const SearchResult found = minimise(problem, usual_start, {.iteration_limit = 5, .iterations_before = 2});
  EXPECT_EQ(found.termination, Termination::iteration_limit);
  EXPECT_EQ(found.iterations, 3);
  EXPECT_EQ(found.reason, "Stopped at the limit of 5 iterations; the cost was still falling.");
}

TEST(Termination, Interrupted) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  int asked = 0;
  SearchOptions options;
  options.interrupted = [&] { return ++asked == 3; };
  const SearchResult found = minimise(problem, usual_start, options);
  EXPECT_EQ(found.termination, Termination::interrupted);
  EXPECT_EQ(found.reason, "Stopped on request after 2 iterations; the cost was still falling.");
}

TEST(Termination, InterruptedAsHopeless) {
  FunctionProblem problem({{"x"}, {"y"}}, rosenbrock);
  SearchOptions options;
  options.hopeless = [](const SearchStep& step) { return step.iteration == 4 && step.cost > 0.1; };
  const SearchResult found = minimise(problem, usual_start, options);
  EXPECT_EQ(found.termination, Termination::interrupted);
  EXPECT_EQ(found.iterations, 4);
}

TEST(Termination, NoSolution) {
  FunctionProblem problem({{"x"}}, [](const Eigen::VectorXd&) { return std::optional<Eigen::VectorXd>(); });
  const SearchResult found = minimise(problem, Eigen::VectorXd::Zero(1), {});
  EXPECT_EQ(found.termination, Termination::no_solution);
  EXPECT_EQ(found.reason, "Failed: there is nothing here.");
  EXPECT_EQ(found.residuals.size(), 0);
}

TEST(Termination, WhatRestsOnTwoSearchesHasSettledIfBothDid) {
  using enum Termination;
  EXPECT_EQ(of_both(on_bound, converged), on_bound);
  EXPECT_EQ(of_both(converged, stalled), stalled);
  EXPECT_EQ(of_both(iteration_limit, converged), iteration_limit);
  EXPECT_EQ(of_both(iteration_limit, stalled), iteration_limit);
}

TEST(Termination, OnlySettledSearchesAreSettled) {
  for (const Termination each :
       {Termination::converged, Termination::on_bound, Termination::stalled, Termination::iteration_limit,
        Termination::interrupted, Termination::no_solution}) {
    EXPECT_EQ(is_settled(each), sentence(each).starts_with("Converged"));
  }
}

}  // namespace
}  // namespace diastole::inference
