#include "estimator/rig_fit/change_point_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole::rig {
namespace {

TEST(ChangePointSearch, FindsWhenASensorStepped) {
  const SpecimenFamily family = gel_family();
  const Effect* step = find_effect("sensor-offset");
  const Session session =
      simulated_session(family, {.terms = {{step, {{"sweep", 2.5, 62.5}}}}, .values = {50.0}});
  const RigProblem problem(session, family);
  const auto found = find_change_points(problem, session, problem.base(), *step);
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->term.change_points.size(), 1);
  EXPECT_EQ(found->term.change_points[0].run, "sweep");
  EXPECT_NEAR(found->term.change_points[0].time_s, 2.5, 0.02);
  EXPECT_NEAR(found->values[0], 50.0, 5.0 * found->fit.errors[3]);
  EXPECT_NEAR(found->fit.reduced(), 1.0, 0.06);
}

TEST(ChangePointSearch, FindsEachLossOfSteps) {
  const SpecimenFamily family = gel_family();
  const Effect* lost = find_effect("missed-steps");
  const Session session = simulated_session(
      family, {.terms = {{lost, {{"baseline", 2.9, 2.9}, {"baseline", 4.37, 4.37}}}}, .values = {0.2, 0.02}});
  const RigProblem problem(session, family);
  const auto found = find_change_points(problem, session, problem.base(), *lost);
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->term.change_points.size(), 2);
  std::vector<double> times{found->term.change_points[0].time_s, found->term.change_points[1].time_s};
  std::sort(times.begin(), times.end());
  EXPECT_NEAR(times[0], 2.9, 1e-3);
  EXPECT_NEAR(times[1], 4.37, 1e-3);
  EXPECT_NEAR(found->values[0], 0.2, 5.0 * found->fit.errors[3]);
}

TEST(ChangePointSearch, AScanPromisesWhatTheSearchFinds) {
  const SpecimenFamily family = gel_family();
  const Effect* step = find_effect("sensor-offset");
  const Session session =
      simulated_session(family, {.terms = {{step, {{"sweep", 2.5, 62.5}}}}, .values = {50.0}});
  const RigProblem problem(session, family);
  const auto promised = promise_change_points(problem, session, problem.base(), *step);
  const auto found = find_change_points(problem, session, problem.base(), *step);
  ASSERT_TRUE(promised.has_value());
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(promised->count, 1);
  const double gain = problem.base().chi_square - promised->residuals.squaredNorm();
  EXPECT_NEAR(gain, found->gain, 0.05 * found->gain);
  EXPECT_FALSE(
      promise_change_points(problem, session, problem.base(), *find_effect("stroke-gain")).has_value());
}

TEST(ChangePointSearch, FindsNothingInNoise) {
  const SpecimenFamily family = gel_family();
  const Session quiet = simulated_session(family, {.seed = 5});
  const RigProblem alone(quiet, family);
  for (const char* id : {"sensor-offset", "missed-steps", "sensor-drift"})
    EXPECT_FALSE(find_change_points(alone, quiet, alone.base(), *find_effect(id)).has_value()) << id;
}

}  // namespace
}  // namespace diastole::rig
