#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "firmware/core/plan_check.hpp"
#include "firmware/core/planner.hpp"
#include "tests/firmware/analytic_profiles.hpp"
#include "tests/firmware/every_profile.hpp"

namespace diastole::firmware {
namespace {

using wire::Waveform;

std::vector<MotionEvent> plan(const Program& program, const Settings& settings, Steps position = {}) {
  Planner planner;
  planner.begin_run(program, settings, Ticks{1'000'000}, position);
  std::vector<MotionEvent> events;
  for (; planner.peek() != nullptr; planner.pop())
    events.push_back(*planner.peek());
  return events;
}

Program program_of(std::initializer_list<Segment> segments, std::uint16_t gate_every = 1) {
  Program program;
  for (const Segment& segment : segments)
    program.segments[program.size++] = segment;
  program.gate_every = gate_every;
  program.rest_us = 500'000;
  program.ttl_width_us = 1'000;
  program.position_period_ticks = 280'000;
  return program;
}

const Settings kSettings(wire::Configure::example());

class EveryMotion : public testing::TestWithParam<NamedProfile> {};
INSTANTIATE_TEST_SUITE_P(Profiles, EveryMotion, testing::ValuesIn(every_moving_profile()),
                         [](const auto& tested) { return tested.param.name; });

/// The analytic waveform, or the profile itself where none is written down.
AnalyticProfile reference(const NamedProfile& named) {
  const auto known = analytic_profiles().find(named.name);
  if (known != analytic_profiles().end()) return known->second;
  const auto crossing = [](Q64 (*phase)(Q64)) {
    return [phase](Real y) { return std::ldexp(Real{1} * phase(static_cast<Q64>(std::ldexp(y, 64))), -64); };
  };
  return {{}, crossing(named.profile->phase_rising), crossing(named.profile->phase_falling)};
}

void expect_analytic_steps(const NamedProfile& named, std::uint32_t stroke_nL, std::uint32_t period_us) {
  const AnalyticProfile analytic = reference(named);
  const Program program = program_of({named.segment(2, stroke_nL, 0, period_us)});
  const std::int32_t count = kSettings.steps_of_nL(stroke_nL).count;
  const Real period = microseconds(period_us).count;
  const std::int64_t first_cycle = 1'000'000 + microseconds(500'000).count;
  std::int64_t step = 0;
  for (const MotionEvent& event : plan(program, kSettings)) {
    if (!event.has(MotionEvent::kStep)) continue;
    const std::int64_t cycle = step / (2 * count), k = step % (2 * count);
    const bool rising = k < count;
    const Real y = (2 * (rising ? k : 2 * count - 1 - k) + 1) / (2.0L * count);
    const Real phase = rising ? analytic.phase_rising(y) : analytic.phase_falling(y);
    const Real exact = static_cast<Real>(first_cycle) + (static_cast<Real>(cycle) + phase) * period;
    ASSERT_LE(std::abs(static_cast<Real>(event.tick.count) - exact), 0.51L) << "step " << step;
    ASSERT_EQ(event.has(MotionEvent::kInflate), rising);
    ASSERT_EQ(event.has(MotionEvent::kCycleStart), k == 0);
    ++step;
  }
  EXPECT_EQ(step, 4 * count);
}

TEST_P(EveryMotion, StepsAreTheAnalyticCrossingsRoundedToATick) {
  expect_analytic_steps(GetParam(), 40'000'000, 1'200'000);
  expect_analytic_steps(GetParam(), 20'000'000, 4'000'000);
  expect_analytic_steps(GetParam(), 8'000, 300'000);
  expect_analytic_steps(GetParam(), 16'000'000, 60'000'000);
}

/// Among these are levels whose crossing is a short binary fraction of the period.
TEST_P(EveryMotion, StepsOfEveryStrokeAreTheAnalyticCrossings) {
  for (std::uint32_t steps = 1; steps <= 256; steps += steps < 40 ? 1 : 12)
    ASSERT_NO_FATAL_FAILURE(expect_analytic_steps(GetParam(), steps * 7'792, 4'000'000)) << steps << " steps";
}

TEST(Planner, AHoldStaysAtOffsetAndStrokeAndTriggersEachCycle) {
  const Program program = program_of({{Waveform::hold, 3, 30'000'000, 5'000'000, 200'000},
                                      {Waveform::parabolic, 1, 1'000'000, 0, 500'000},
                                      {Waveform::hold, 1, 0, 0, 300'000}},
                                     2);
  ASSERT_TRUE(check_program(program, kSettings).ok());
  const Ticks start{1'000'000};
  std::vector<Ticks> expected, cycle_starts;
  for (int i = 0; i < 3; ++i)
    expected.push_back(start + Planner::segment_offset(program, kSettings, 0) + microseconds(200'000) * i);
  std::int32_t position = 0, ends = 0, r_waves = 0;
  Ticks before{0};
  for (const MotionEvent& event : plan(program, kSettings)) {
    ASSERT_GE((event.tick - before).count, microseconds(100).count);
    before = event.tick;
    if (event.has(MotionEvent::kStep)) position += event.has(MotionEvent::kInflate) ? 1 : -1;
    if (event.has(MotionEvent::kRWave)) ++r_waves;
    if (event.has(MotionEvent::kCycleEnd)) ++ends;
    if (!event.has(MotionEvent::kCycleStart)) continue;
    cycle_starts.push_back(event.tick);
    if (cycle_starts.size() <= 3) {
      EXPECT_EQ(position, kSettings.steps_of_nL(35'000'000).count);
      EXPECT_EQ(event.has(MotionEvent::kSegmentStart), cycle_starts.size() == 1);
    }
  }
  EXPECT_EQ(position, 0);
  EXPECT_EQ(ends, 5);
  EXPECT_EQ(r_waves, 3);
  ASSERT_EQ(cycle_starts.size(), 5U);
  EXPECT_EQ(std::vector<Ticks>(cycle_starts.begin(), cycle_starts.begin() + 3), expected);
  EXPECT_EQ(cycle_starts[4], start + Planner::segment_offset(program, kSettings, 2));
}

TEST(Planner, AStopAtCycleEndIsHeardDuringAHold) {
  const Program program = program_of({{Waveform::hold, 100, 30'000'000, 0, 2'000'000}});
  Planner planner;
  planner.begin_run(program, kSettings, Ticks{0}, Steps{0});
  int cycles = 0;
  for (; planner.peek() != nullptr; planner.pop()) {
    if (!planner.peek()->has(MotionEvent::kCycleStart)) continue;
    if (++cycles == 2) {
      planner.pop();
      planner.stop_at_cycle_end();
    }
  }
  EXPECT_EQ(cycles, 2);
}

TEST_P(EveryMotion, TimesIncreaseAndEveryCycleEndsWhereItBegan) {
  const NamedProfile& named = GetParam();
  const Program program = program_of({named.segment(50, 20'000'000, 0, 1'200'000),
                                      named.segment(30, 20'000'000, 10'000'000, 2'000'000),
                                      named.segment(20, 10'000'000, 5'000'000, 1'000'000)});
  ASSERT_TRUE(check_program(program, kSettings).ok());
  std::int32_t position = 0;
  std::size_t segment = 0, cycles = 0;
  std::int32_t offset = 0;
  Ticks before{0};
  for (const MotionEvent& event : plan(program, kSettings)) {
    ASSERT_GT(event.tick, before);
    before = event.tick;
    if (event.has(MotionEvent::kSegmentStart)) {
      offset = kSettings.steps_of_nL(program.segments[segment++].offset_nL).count;
      ASSERT_EQ(position, offset);
    }
    if (event.has(MotionEvent::kStep)) position += event.has(MotionEvent::kInflate) ? 1 : -1;
    if (event.has(MotionEvent::kCycleEnd)) {
      ASSERT_EQ(position, offset);
      ++cycles;
    }
  }
  EXPECT_EQ(segment, 3U);
  EXPECT_EQ(cycles, 100U);
  EXPECT_EQ(position, 0);
}

TEST_P(EveryMotion, NothingDriftsOverTenMillionSteps) {
  const Program program = program_of({GetParam().segment(1000, 40'000'000, 0, 1'200'000)});
  Planner planner;
  planner.begin_run(program, kSettings, Ticks{0}, Steps{0});
  std::int64_t position = 0, steps = 0;
  Ticks last_cycle_start{-1};
  for (; planner.peek() != nullptr; planner.pop()) {
    const MotionEvent& event = *planner.peek();
    if (event.has(MotionEvent::kCycleStart)) {
      if (last_cycle_start > Ticks{0}) {
        ASSERT_EQ(event.tick - last_cycle_start, microseconds(1'200'000));
      }
      last_cycle_start = event.tick;
    }
    if (!event.has(MotionEvent::kStep)) continue;
    position += event.has(MotionEvent::kInflate) ? 1 : -1;
    ++steps;
  }
  EXPECT_EQ(steps, 2 * 5134 * 1000);
  EXPECT_EQ(position, 0);
}

TEST(Planner, RampsAreSmoothAndWithinTheLimits) {
  const Program program = program_of({{Waveform::sinusoidal, 1, 20'000'000, 500'000'000, 2'000'000}});
  const wire::Configure limits = wire::Configure::example();
  double fastest = 0;
  Ticks last{0};
  bool cycling = false;
  for (const MotionEvent& event : plan(program, kSettings)) {
    if (event.has(MotionEvent::kSegmentStart)) cycling = true;
    if (event.has(MotionEvent::kCycleEnd)) cycling = false;
    if (!event.has(MotionEvent::kStep)) continue;
    if (!cycling) fastest = std::max(fastest, 1e0 / static_cast<double>((event.tick - last).count));
    last = event.tick;
  }
  const double fastest_uL_per_s = fastest * kTicksPerSecond * limits.microstep_pL * 1e-6;
  EXPECT_LE(fastest_uL_per_s, 0.51 * limits.flow_uL_per_s);
  EXPECT_GT(fastest_uL_per_s, 0.1 * limits.flow_uL_per_s);
}

TEST(Planner, RWaveAtEveryNthCycleOfTheRun) {
  const Program program = program_of(
      {{Waveform::parabolic, 3, 1'000'000, 0, 500'000}, {Waveform::parabolic, 4, 2'000'000, 0, 500'000}}, 2);
  std::vector<bool> played;
  for (const MotionEvent& event : plan(program, kSettings))
    if (event.has(MotionEvent::kCycleStart)) played.push_back(event.has(MotionEvent::kRWave));
  EXPECT_EQ(played, (std::vector<bool>{true, false, true, false, true, false, true}));
}

TEST(Planner, ARunFromElsewhereReturnsToZeroBeforeItsRest) {
  const Program program = program_of({{Waveform::parabolic, 1, 1'000'000, 0, 500'000}});
  std::int32_t position = 700;
  std::int64_t first_up = 0, last_down = 0;
  for (const MotionEvent& event : plan(program, kSettings, Steps{700})) {
    if (event.has(MotionEvent::kSegmentStart)) {
      EXPECT_EQ(position, 0);
    }
    if (!event.has(MotionEvent::kStep)) continue;
    position += event.has(MotionEvent::kInflate) ? 1 : -1;
    if (first_up == 0 && event.has(MotionEvent::kInflate)) first_up = event.tick.count;
    if (first_up == 0) last_down = event.tick.count;
  }
  EXPECT_EQ(position, 0);
  EXPECT_GT(first_up - last_down, microseconds(500'000).count);
}

TEST(Planner, SegmentOffsetsAreWhereTheSegmentsStart) {
  const Program program = program_of({{Waveform::parabolic, 3, 1'000'000, 0, 500'000},
                                      {Waveform::sinusoidal, 4, 2'000'000, 30'000'000, 700'000},
                                      {Waveform::parabolic, 1, 2'000'000, 10'000'000, 900'000}});
  std::size_t segment = 0;
  for (const MotionEvent& event : plan(program, kSettings))
    if (event.has(MotionEvent::kSegmentStart)) {
      EXPECT_EQ((event.tick - Ticks{1'000'000}).count,
                Planner::segment_offset(program, kSettings, segment).count);
      ++segment;
    }
  EXPECT_EQ(segment, 3U);
}

class StopPhase : public testing::TestWithParam<int> {};

TEST_P(StopPhase, DeceleratesWithinTheLimitFromAnyPhase) {
  const Program program = program_of({{Waveform::parabolic, 2, 40'000'000, 0, 1'200'000}});
  Planner planner;
  planner.begin_run(program, kSettings, Ticks{0}, Steps{0});
  const Ticks stop_at = microseconds(500'000 + 15'000 * GetParam());
  Ticks last{0}, interval{0};
  bool inflate = false;
  for (; planner.peek() != nullptr && planner.peek()->tick < stop_at; planner.pop()) {
    if (!planner.peek()->has(MotionEvent::kStep)) continue;
    interval = planner.peek()->tick - last;
    last = planner.peek()->tick;
    inflate = planner.peek()->has(MotionEvent::kInflate);
  }
  const double limit = static_cast<double>(kSettings.stop_steps_per_s2());
  planner.begin_stop(stop_at - microseconds(9'000), kSettings.stop_steps_per_s2());
  double speed = static_cast<double>(kTicksPerSecond) / static_cast<double>(interval.count);
  const double first_speed = speed;
  Ticks end{0};
  for (; planner.peek() != nullptr; planner.pop()) {
    end = planner.peek()->tick;
    if (planner.peek()->has(MotionEvent::kEnd)) break;
    ASSERT_EQ(planner.peek()->has(MotionEvent::kInflate), inflate);
    const double dt = static_cast<double>((end - last).count) / kTicksPerSecond;
    ASSERT_LE(1 / dt, speed * 1.001 + 1);
    // Speed over a step is known to about one part in the number of steps left.
    ASSERT_LE((speed - 1 / dt) / dt, 3 * limit);
    speed = 1 / dt;
    last = end;
  }
  const double stopping_s = static_cast<double>((end - stop_at).count) / kTicksPerSecond;
  EXPECT_LE(stopping_s, first_speed / limit * 1.1 + 0.03);
}

INSTANTIATE_TEST_SUITE_P(Phases, StopPhase, testing::Range(0, 160, 3));

/// The timer needs some time between two events, and only one event can be the end.
void expect_orderly_end(Planner planner, Ticks after) {
  bool ended = false;
  for (; planner.peek() != nullptr; planner.pop()) {
    ASSERT_FALSE(ended);
    ASSERT_GE((planner.peek()->tick - after).count, microseconds(100).count);
    after = planner.peek()->tick;
    ended = planner.peek()->has(MotionEvent::kEnd);
  }
  ASSERT_TRUE(ended);
}

class StopBehind : public testing::TestWithParam<NamedProfile> {};

TEST_P(StopBehind, EveryEventLiesLaterThanWhatIsQueued) {
  const Program program = program_of(
      {GetParam().segment(2, 1'000'000, 0, 800'000), GetParam().segment(1, 800'000, 500'000, 700'000)});
  Planner planner;
  planner.begin_run(program, kSettings, Ticks{1'000'000}, Steps{30});
  Ticks last{0};
  std::size_t stops = 0;
  for (; planner.peek() != nullptr; planner.pop(), ++stops) {
    for (const std::int64_t lead_us : {-9'000, 0, 1'000}) {
      Planner stopped = planner;
      const Ticks earliest = std::min(last + microseconds(lead_us), planner.peek()->tick);
      stopped.begin_stop(earliest, kSettings.stop_steps_per_s2());
      SCOPED_TRACE(stops);
      ASSERT_NO_FATAL_FAILURE(expect_orderly_end(stopped, last));
    }
    last = planner.peek()->tick;
  }
  EXPECT_GT(stops, GetParam().moves() ? 700U : 300U);
  planner.begin_stop(last + microseconds(1'000), kSettings.stop_steps_per_s2());
  EXPECT_EQ(planner.peek(), nullptr) << "a second end";
}

INSTANTIATE_TEST_SUITE_P(Profiles, StopBehind, testing::ValuesIn(every_profile()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace diastole::firmware
