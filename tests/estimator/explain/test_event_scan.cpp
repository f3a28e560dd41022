// Moments in recordings that the model itself made: a test of the scan, not of the physics.

#include "estimator/explain/rig/event_scan.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

constexpr double half_a_cycle_s = 0.6;  // features hold a cycle's level and size, no more

class EventScan : public testing::Test {
 protected:
  [[nodiscard]] std::optional<rig::SessionModel> scanned(const rig::Session& session, const char* id) const {
    const rig::SessionProblem problem(session, family_, 2);
    const rig::LinearisedModel base = rig::declared_rig(problem);
    return scan_events(problem, fit_set(problem, base.at, base, problem.error().prior.share),
                       *find_effect(id));
  }
  rig::SpecimenFamily family_ = rig::gel_family();
};

TEST_F(EventScan, FindsWhenASensorStepped) {
  const rig::Session session = rig::simulated_session(
      family_, {.terms = {{find_effect("sensor-offset"), {{"sweep", 2.5, 62.5}}}}, .values = {50.0}});
  const auto found = scanned(session, "sensor-offset");
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->terms.front().change_points.size(), 1);
  EXPECT_EQ(found->terms.front().change_points[0].run, "sweep");
  EXPECT_NEAR(found->terms.front().change_points[0].time_s, 2.5, 0.1);
  EXPECT_NEAR(found->values[0], 50.0, 10.0);
}

TEST_F(EventScan, FindsEachLossOfSteps) {
  const rig::Session session = rig::simulated_session(
      family_, {.terms = {{find_effect("missed-steps"), {{"baseline", 2.9, 2.9}, {"baseline", 4.37, 4.37}}}},
                .values = {1.0, 0.02}});
  const auto found = scanned(session, "missed-steps");
  ASSERT_TRUE(found.has_value());
  ASSERT_EQ(found->terms.front().change_points.size(), 2);
  std::vector<double> times{found->terms.front().change_points[0].time_s,
                            found->terms.front().change_points[1].time_s};
  std::ranges::sort(times);
  EXPECT_NEAR(times[0], 2.9, half_a_cycle_s);
  EXPECT_NEAR(times[1], 4.37, half_a_cycle_s);
}

TEST_F(EventScan, FindsNothingInNoise) {
  const rig::Session quiet = rig::simulated_session(family_, {.seed = 5});
  for (const char* id : {"sensor-offset", "missed-steps"})
    EXPECT_FALSE(scanned(quiet, id).has_value()) << id;
}

}  // namespace
}  // namespace diastole::explain
