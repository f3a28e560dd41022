// Every scenario of scenario_list.cpp on the recording board and on the emulated one: equal edges, and where
// something happens at its own time, equal up to then and within a stated bound after.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/scenario.hpp"

namespace diastole::sim_board_test {
namespace {

using sim_controller::Pin;

constexpr int64_t in_ticks(uint64_t time_ns) { return static_cast<int64_t>(time_ns * 84 / 1000); }

std::size_t equal_edges(const std::vector<TimedEdge>& a, const std::vector<TimedEdge>& b) {
  return static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
}

/// The wave's first code leaves one tick after the TTL: TIM4 counts one before it updates.
void expect_equal_waves(const Motion& built, const Motion& image) {
  ASSERT_EQ(built.wave.size(), image.wave.size());
  for (std::size_t i = 0; i < built.wave.size(); ++i) {
    ASSERT_EQ(built.wave[i].value, image.wave[i].value) << "code " << i;
    ASSERT_LE(std::abs(built.wave[i].tick - image.wave[i].tick), 1) << "code " << i;
  }
}

void expect_equal(const Motion& built, const Motion& image) {
  ASSERT_EQ(built.edges.size(), image.edges.size());
  ASSERT_GT(built.edges.size(), 0U);
  for (std::size_t i = 0; i < built.edges.size(); ++i)
    ASSERT_EQ(built.edges[i], image.edges[i]) << "edge " << i;
  expect_equal_waves(built, image);
  EXPECT_EQ(built.end_microsteps, image.end_microsteps);
  EXPECT_EQ(built.reason, image.reason);
}

/// STEP rises from `tick` on.
std::vector<int64_t> steps_from(const Motion& motion, int64_t tick) {
  std::vector<int64_t> steps;
  for (const TimedEdge& edge : motion.edges)
    if (edge.pin == Pin::step && edge.value == 1 && edge.tick >= tick) steps.push_back(edge.tick);
  return steps;
}

/// Where the motor has gone, in microsteps from its first edge.
int64_t way(const Motion& motion) {
  const auto turn = std::ranges::find(motion.edges, Pin::dir, &TimedEdge::pin);
  int64_t steps = 0, direction = turn != motion.edges.end() && turn->value == 1 ? -1 : 1;
  for (const TimedEdge& edge : motion.edges) {
    if (edge.pin == Pin::dir) direction = edge.value == 1 ? 1 : -1;
    if (edge.pin == Pin::step && edge.value == 1) steps += direction;
  }
  return steps;
}

/// The fast stages go on beyond the switch by what the main loop had planned, some steps more or fewer on either
/// board; both end at the same place, by the same last steps.
void expect_equal_reference(const Motion& built, const Motion& image) {
  EXPECT_EQ(built.end_microsteps, image.end_microsteps);
  EXPECT_EQ(way(built), way(image));
  auto a = steps_from(built, INT64_MIN), b = steps_from(image, INT64_MIN);
  constexpr std::size_t kClearance = 64;
  ASSERT_GT(a.size(), kClearance);
  ASSERT_GT(b.size(), kClearance);
  EXPECT_NEAR(static_cast<double>(a.size()), static_cast<double>(b.size()), 16);
  for (std::size_t i = 2; i <= kClearance; ++i)
    ASSERT_EQ(a[a.size() - i + 1] - a[a.size() - i], b[b.size() - i + 1] - b[b.size() - i])
        << i << " steps before the end";
}

/// Equal until `act_tick`; from then on the motor's power and the fault follow within `bound` of each other.
void expect_equal_until(const Motion& built, const Motion& image, int64_t act_tick, int64_t bound) {
  // The time of an input, in whole nanoseconds, is one tick sure.
  const auto before = [act_tick](const TimedEdge& edge) { return edge.tick < act_tick - 1; };
  const auto same = static_cast<std::ptrdiff_t>(equal_edges(built.edges, image.edges));
  EXPECT_EQ(std::find_if(built.edges.begin() + same, built.edges.end(), before), built.edges.end());
  EXPECT_EQ(std::find_if(image.edges.begin() + same, image.edges.end(), before), image.edges.end());
  EXPECT_GT(same, 100);
  expect_equal_waves(built, image);
  EXPECT_EQ(built.fault, image.fault);
  EXPECT_EQ(built.reason, image.reason);
  // ENABLE rises when Start is taken, some microseconds apart; DIR and the rest hang on the run's time zero.
  ASSERT_EQ(built.switches.size(), image.switches.size());
  for (std::size_t i = 0; i < built.switches.size(); ++i) {
    EXPECT_EQ(built.switches[i].pin, image.switches[i].pin);
    EXPECT_EQ(built.switches[i].value, image.switches[i].value);
    EXPECT_NEAR(static_cast<double>(built.switches[i].tick), static_cast<double>(image.switches[i].tick),
                static_cast<double>(std::max(bound, in_ticks(20'000))));
  }
}

/// Nothing but the pulse that was already on its way, or what comes before the order has arrived.
void expect_cut(const Motion& motion, int64_t act_tick, uint64_t latency) {
  for (const int64_t step : steps_from(motion, act_tick))
    EXPECT_LE(step - act_tick, in_ticks(latency));
}

/// A controlled stop that begins up to `latency` later ends that much later, and longer by what the program's
/// own acceleration adds to the speed meanwhile; here at most twice.
void expect_alike_stops(const Motion& built, const Motion& image, int64_t act_tick, uint64_t latency) {
  const auto a = steps_from(built, act_tick), b = steps_from(image, act_tick);
  ASSERT_FALSE(a.empty());
  ASSERT_FALSE(b.empty());
  EXPECT_NEAR(static_cast<double>(a.back()), static_cast<double>(b.back()),
              static_cast<double>(in_ticks(2 * latency)));
  constexpr double fastest_steps_per_s = 17'200;  // 40 mL in 1.2 s
  EXPECT_NEAR(static_cast<double>(built.end_microsteps), static_cast<double>(image.end_microsteps),
              fastest_steps_per_s * 2e-9 * static_cast<double>(latency));
}

class Scenarios : public testing::TestWithParam<Scenario> {};

TEST_P(Scenarios, GiveEqualEdgesOnBothBoards) {
  if (!std::filesystem::exists(firmware))
    GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
  const Scenario& scenario = GetParam();
  const auto built_rig = recorded_rig(), image_rig = emulated_rig(firmware);
  const Session built = hold(scenario, *built_rig), image = hold(scenario, *image_rig);
  const uint64_t latency = latency_ns(scenario.act);
  if (scenario.to_a_switch) {
    expect_equal_reference(built.motion, image.motion);
  } else if (latency == 0) {
    expect_equal(built.motion, image.motion);
  } else {
    const int64_t act_tick = in_ticks(scenario.act_after_ms * 1'000'000);
    expect_equal_until(built.motion, image.motion, act_tick, in_ticks(latency));
    if (scenario.act == Act::stop_now || scenario.act == Act::silence)
      expect_alike_stops(built.motion, image.motion, act_tick, latency);
    else
      for (const Motion& motion : {built.motion, image.motion})
        expect_cut(motion, act_tick, latency);
  }
  ASSERT_EQ(built.again.has_value(), image.again.has_value());
  if (!built.again) return;
  EXPECT_EQ(built.again->fault, wire::Fault::none);
  EXPECT_EQ(built.again->reason, wire::RunEnd::completed);
  expect_equal(*built.again, *image.again);
}

INSTANTIATE_TEST_SUITE_P(All, Scenarios, testing::ValuesIn(scenarios()),
                         [](const auto& scenario) { return scenario.param.name; });

}  // namespace
}  // namespace diastole::sim_board_test
