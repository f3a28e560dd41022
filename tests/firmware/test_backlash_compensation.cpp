// Backlash: a load that the motor drives with play follows the plan, for every waveform, except in the windows behind
// its turning points.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "firmware/core/backlash_compensation.hpp"
#include "protocol/wire/wire_text.hpp"
#include "tests/firmware/bench.hpp"
#include "tests/firmware/every_profile.hpp"

namespace diastole::firmware {
namespace {

using wire::State;
using wire::Waveform;

struct Step {
  Ticks tick;
  bool inflate = false;
};

std::vector<Step> steps_of(const std::vector<Edge>& edges, bool& inflate) {
  std::vector<Step> steps;
  for (const Edge& edge : edges) {
    if (edge.signal == Signal::DIR) inflate = edge.value != 0;
    if (edge.signal == Signal::STEP && edge.value == 1) steps.push_back({edge.tick, inflate});
  }
  return steps;
}

/// A bench with a play of so many steps; the firmware knows of `known_nm`.
struct PlayBench {
  explicit PlayBench(std::int32_t play_steps, std::int32_t known_nm) : bench(options(play_steps)) {
    bench.connect();
    if (known_nm >= 0) {
      wire::WriteSettings write;
      write.settings.backlash_nm = known_nm;
      EXPECT_TRUE(bench.ask(write));
    }
    bench.prepare();
    (void)bench.rig.take_edges();
  }
  static RecordedController::Options options(std::int32_t play_steps) {
    RecordedController::Options options;
    options.board.mechanics.play_steps = play_steps;
    return options;
  }
  Bench bench;
};

void add_program(Bench& bench, Waveform waveform) {
  bench.add_segment(waveform, 3, 8'000'000, 1'500'000);
  bench.add_segment(waveform, 2, 6'000'000, 1'300'000, 3'000'000);
}

class EveryWaveformWithPlay : public testing::TestWithParam<Waveform> {};

TEST_P(EveryWaveformWithPlay, TheLoadFollowsThePlanOutsideOfTheWindows) {
  constexpr std::int32_t play = 40;  // 40 µm
  // What the load should do: the steps of a rig without play.
  PlayBench ideal(0, -1);
  add_program(ideal.bench, GetParam());
  ideal.bench.run_program();
  bool inflate = true;
  const std::vector<Step> planned = steps_of(ideal.bench.rig.take_edges(), inflate);
  ASSERT_EQ(ideal.bench.heard.ended.size(), 1U);
  const Ticks planned_start{static_cast<std::int64_t>(ideal.bench.heard.started[0].tick)};

  PlayBench real(play, 40'000);
  add_program(real.bench, GetParam());
  real.bench.run_program();
  inflate = true;
  const std::vector<Step> made = steps_of(real.bench.rig.take_edges(), inflate);
  ASSERT_EQ(real.bench.heard.ended.size(), 1U) << wire::waveform_name(GetParam());
  ASSERT_EQ(real.bench.heard.ended[0].reason, wire::RunEnd::completed);
  EXPECT_EQ(real.bench.heard.ended[0].position_microsteps, 0);
  const Ticks start{static_cast<std::int64_t>(real.bench.heard.started[0].tick)};
  EXPECT_EQ(real.bench.heard.triggers.size(), ideal.bench.heard.triggers.size());
  for (std::size_t i = 0; i < real.bench.heard.triggers.size(); ++i)
    EXPECT_EQ(real.bench.heard.triggers[i].tick - static_cast<std::uint64_t>(start.count),
              ideal.bench.heard.triggers[i].tick - static_cast<std::uint64_t>(planned_start.count));
  EXPECT_EQ(real.bench.heard.positions, ideal.bench.heard.positions) << "positions are the load's";

  // The window as the firmware states it.
  Program program;
  program.segments[program.size++] = {GetParam(), 3, 8'000'000, 0, 1'500'000};
  program.segments[program.size++] = {GetParam(), 2, 6'000'000, 3'000'000, 1'300'000};
  const auto window_us = check_compensation(program, Settings(wire::Configure::example()), play);
  ASSERT_TRUE(window_us.ok());
  const Ticks window = microseconds(*window_us);

  // Play the motor's steps through the analytic element of play, and compare at every step of either.
  std::int32_t motor = 0, load = 0, plan = 0, worst = 0;
  std::size_t next_made = 0;
  Ticks turned{-kTicksPerSecond};  // the last step of the plan before its last change of direction
  Ticks before = turned;
  bool up = true;
  for (std::size_t i = 0; i <= planned.size(); ++i) {
    const Ticks until = i < planned.size() ? planned[i].tick - planned_start : Ticks{1LL << 60};
    for (; next_made < made.size() && made[next_made].tick - start <= until; ++next_made) {
      const Ticks now = made[next_made].tick - start;
      motor += made[next_made].inflate ? 1 : -1;
      load = std::clamp(load, motor, motor + play);
      if (now > turned + window && now < until) worst = std::max(worst, std::abs(load - plan));
    }
    if (i == planned.size()) break;
    // A hold's last mark, which begins the window, comes no later than the first step of the ramp behind it.
    if (planned[i].inflate != up) turned = GetParam() == Waveform::hold ? until : before;
    up = planned[i].inflate;
    plan += up ? 1 : -1;
    before = until;
    if (until > turned + window) worst = std::max(worst, std::abs(load - plan));
  }
  EXPECT_LE(worst, 1) << wire::waveform_name(GetParam());
  EXPECT_EQ(load, 0);
  EXPECT_EQ(real.bench.rig.load_microsteps() - real.bench.rig.mechanical_microsteps(), play);

  // Never faster than allowed.
  const Settings settings(wire::Configure::example());
  const std::int64_t least = kTicksPerSecond / settings.limits().step_rate_Hz;
  for (std::size_t i = 1; i < made.size(); ++i)
    ASSERT_GE((made[i].tick - made[i - 1].tick).count, least) << i;
}

INSTANTIATE_TEST_SUITE_P(Waveforms, EveryWaveformWithPlay,
                         testing::Values(Waveform::parabolic, Waveform::sinusoidal, Waveform::trapezoidal,
                                         Waveform::sawtooth, Waveform::reversed_sawtooth, Waveform::hold));

TEST(BacklashCompensation, WithoutPlayEveryEdgeIsAsBefore) {
  PlayBench plain(0, -1), written(0, 0);
  std::vector<Edge> edges[2];
  Ticks start[2];
  int i = 0;
  for (Bench* bench : {&plain.bench, &written.bench}) {
    add_program(*bench, Waveform::parabolic);
    bench->run_program();
    edges[i] = bench->rig.take_edges();
    start[i++] = Ticks{static_cast<std::int64_t>(bench->heard.started.at(0).tick)};
  }
  ASSERT_EQ(edges[0].size(), edges[1].size());
  for (std::size_t k = 0; k < edges[0].size(); ++k)
    ASSERT_EQ((edges[0][k].tick - start[0]).count, (edges[1][k].tick - start[1]).count);
}

TEST(BacklashCompensation, DoesNotDriftOverManyCyclesJogsAndStops) {
  PlayBench play(40, 40'000);
  Bench& bench = play.bench;
  const std::int32_t reference = bench.rig.load_microsteps();
  std::mt19937 random(4);
  for (int round = 0; round < 40; ++round) {
    ASSERT_TRUE(bench.ask(wire::ClearProgram{}));
    add_program(bench, Waveform::sinusoidal);
    ASSERT_TRUE(bench.ask(wire::Arm::example()));
    ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
    bench.run_for(microseconds(1'050'000 + static_cast<std::int64_t>(random() % 9'000'000)));
    if (bench.state() == State::running) bench.request(wire::StopNow{});
    ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(20'000'000)));
    const std::int32_t position = bench.rig.position_microsteps();
    ASSERT_NEAR(bench.rig.load_microsteps() - reference, position, 0) << round;
    const std::int64_t away_nL = position > 500 ? -1'000'000 : 1'000'000;
    ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, away_nL, 5'000}));
    ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(20'000'000)));
    ASSERT_EQ(bench.rig.load_microsteps() - reference, bench.rig.position_microsteps()) << round;
  }
}

TEST(BacklashCompensation, AProgramThatLeavesNoTimeForItIsRefused) {
  PlayBench play(900, 900'000);
  play.bench.add_segment(Waveform::parabolic, 1, 1'000'000, 500'000);
  EXPECT_FALSE(play.bench.ask(wire::Arm::example()));
  EXPECT_EQ(play.bench.heard.naks.back().limit, wire::Limit::take_up);
  EXPECT_EQ(play.bench.heard.naks.back().allowed, 62'500);
  EXPECT_GT(play.bench.heard.naks.back().asked, 62'500);
}

TEST(BacklashCompensation, ALostLeaseStillEndsInTime) {
  PlayBench play(40, 40'000);
  Bench& bench = play.bench;
  for (int moment = 0; moment < 30; ++moment) {
    ASSERT_TRUE(bench.ask(wire::ClearProgram{}));
    add_program(bench, Waveform::parabolic);
    ASSERT_TRUE(bench.ask(wire::Arm::example()));
    ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
    bench.run_for(microseconds(1'200'000 + moment * 53'000));
    bench.heartbeats = false;
    (void)bench.rig.take_edges();
    const Ticks silent = bench.rig.now();
    bench.run_for(microseconds(600'000));
    ASSERT_EQ(bench.state(), State::faulted);
    bool inflate = true;
    const auto steps = steps_of(bench.rig.take_edges(), inflate);
    if (!steps.empty()) {
      ASSERT_LE((steps.back().tick - silent).count, microseconds(500'000).count);
    }
    bench.heartbeats = true;
    bench.run_for(microseconds(100'000));
    ASSERT_TRUE(bench.ask(wire::ClearFault{}));
    ASSERT_EQ(bench.state(), State::homed);
  }
}

}  // namespace
}  // namespace diastole::firmware
