// Homing as the switch and the motor see it: ramps, repeatability, stops, and what can be wrong with a switch.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::Fault;
using wire::Refusal;
using wire::State;

constexpr std::int32_t kReference = 1 + static_cast<std::int32_t>(kHomeClearance_steps);

RecordedController::Options standing_at(std::int32_t steps, std::int32_t hysteresis = 0) {
  RecordedController::Options options;
  options.board.mechanics.start_steps = steps;
  options.board.mechanics.home_hysteresis_steps = hysteresis;
  return options;
}

/// Precondition: connected and configured. Waits for the end.
void home(Bench& bench) {
  ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() != State::homing; }, microseconds(600'000'000)));
}

/// The largest change of speed between neighbouring intervals in one direction, in steps/s².
double hardest_change(const std::vector<Edge>& edges) {
  double hardest = 0, before_s = 0;
  Ticks last{-kTicksPerSecond};
  bool inflate = false, turned = false;
  for (const Edge& edge : edges) {
    if (edge.signal == Signal::DIR) turned = std::exchange(inflate, edge.value != 0) != inflate;
    if (edge.signal != Signal::STEP || edge.value == 0) continue;
    const double now_s = static_cast<double>((edge.tick - last).count) / kTicksPerSecond;
    if (!std::exchange(turned, false) && before_s > 0)
      hardest = std::max(hardest, std::abs(1 / now_s - 1 / before_s) * 2 / (now_s + before_s));
    before_s = now_s;
    last = edge.tick;
  }
  return hardest;
}

TEST(Homing, EndsAtTheSamePlaceFromEverywhereWhateverTheHysteresis) {
  for (const std::int32_t hysteresis : {0, 3, 20, 60}) {
    for (const std::int32_t from : {400, 5000, 1, 0, -1, -300, 64, 65, 66, 12'345}) {
      Bench bench(standing_at(from, hysteresis));
      bench.prepare();
      ASSERT_EQ(bench.state(), State::homed) << from;
      EXPECT_EQ(bench.rig.position_microsteps(), 0);
      EXPECT_EQ(bench.rig.mechanical_microsteps(), kReference + hysteresis) << from << " " << hysteresis;
    }
  }
}

TEST(Homing, AgainAndAgainFindsTheSamePlace) {
  Bench bench(standing_at(3000, 17));
  bench.prepare();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, 1'000'000 + i * 777'777, 20'000}));
    ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(20'000'000)));
    home(bench);
    ASSERT_EQ(bench.rig.mechanical_microsteps(), kReference + 17);
  }
}

TEST(Homing, FastOneBeginsAndEndsWithRamps) {
  Bench bench(standing_at(30'000));
  wire::Configure configure = wire::Configure::example();
  configure.homing_flow_uL_per_s = 80'000;
  configure.acceleration_uL_per_s2 = 400'000;
  bench.connect();
  ASSERT_TRUE(bench.ask(configure));
  (void)bench.rig.take_edges();
  home(bench);
  EXPECT_EQ(bench.state(), State::homed);
  EXPECT_EQ(bench.rig.mechanical_microsteps(), kReference);
  const auto limit = static_cast<double>(Settings(configure).stop_steps_per_s2());
  EXPECT_LE(hardest_change(bench.rig.take_edges()), 1.1 * limit);
}

TEST(Homing, StopNowBringsItToRestUnhomedAtAnyMoment) {
  for (int moment = 0; moment < 60; ++moment) {
    Bench bench(standing_at(2000, 5));
    bench.connect();
    ASSERT_TRUE(bench.ask(wire::Configure::example()));
    ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
    bench.run_for(microseconds(moment * 97'000));
    if (bench.state() != State::homing) break;
    ASSERT_TRUE(bench.ask(wire::StopNow{})) << moment;
    ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::unhomed; }, microseconds(300'000)))
        << moment << " in state " << static_cast<int>(bench.state());
    EXPECT_TRUE(bench.heard.faults.empty());
    home(bench);
    ASSERT_EQ(bench.rig.mechanical_microsteps(), kReference + 5) << moment;
  }
}

TEST(Homing, ASilentHostStopsItUnderControlWithinTheLease) {
  Bench bench(standing_at(20'000));
  bench.connect();
  ASSERT_TRUE(bench.ask(wire::Configure::example()));
  ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
  bench.run_for(microseconds(1'000'000));
  bench.cable = false;
  const Ticks unplugged = bench.rig.now();
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::faulted; }, microseconds(500'000)));
  EXPECT_LE((bench.rig.now() - unplugged).count, microseconds(500'000).count);
  EXPECT_EQ(bench.rig.controller().motion().safety().fault(), Fault::lease_lost);
  bench.cable = true;
  bench.run_for(microseconds(500'000));
  EXPECT_TRUE(bench.ask(wire::ClearFault{}));
  EXPECT_EQ(bench.state(), State::unhomed);
}

TEST(Homing, ASwitchThatStaysClosedIsNamed) {
  RecordedController::Options options = standing_at(500);
  options.board.mechanics.home_stuck = true;
  Bench bench(options);
  wire::Configure configure = wire::Configure::example();
  configure.travel_uL = 50'000;
  bench.prepare(configure);
  ASSERT_FALSE(bench.heard.faults.empty());
  EXPECT_EQ(bench.heard.faults[0].fault, Fault::home_switch_stuck);
}

TEST(Homing, AMotorThatTurnsTheWrongWayIsCutOffAtTheFarLimit) {
  Bench bench(standing_at(20'000));
  bench.connect();
  ASSERT_TRUE(bench.ask(wire::Configure::example()));
  ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
  bench.run_for(microseconds(1'000'000));
  ASSERT_EQ(bench.state(), State::homing);
  const std::int32_t there = bench.rig.mechanical_microsteps();
  bench.rig.set_far_limit(true);
  bench.run_for(microseconds(100'000));
  EXPECT_EQ(bench.state(), State::faulted);
  EXPECT_EQ(bench.rig.controller().motion().safety().fault(), Fault::limit_switch);
  EXPECT_EQ(bench.rig.mechanical_microsteps(), there);
}

TEST(Homing, FromTheFarLimitItWithdraws) {
  RecordedController::Options options = standing_at(3000);
  options.board.mechanics.far_limit_steps = 2990;
  Bench bench(options);
  bench.prepare();
  EXPECT_EQ(bench.state(), State::homed);
}

TEST(Jog, MovesByTheDistanceAndKeepsThePosition) {
  Bench bench;
  bench.prepare();
  const std::int32_t home_at = bench.rig.mechanical_microsteps();
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, 5'000'000, 10'000}));
  EXPECT_EQ(bench.state(), State::jogging);
  EXPECT_FALSE(bench.ask(wire::Jog{0, Bench::kLease, 5'000'000, 10'000}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(2'000'000)));
  EXPECT_EQ(bench.rig.position_microsteps(), 642);  // 5 mL of 7.79 µL
  EXPECT_EQ(bench.rig.mechanical_microsteps() - home_at, 642);
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, -5'000'000, 10'000}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(2'000'000)));
  EXPECT_EQ(bench.rig.position_microsteps(), 0);
}

TEST(Jog, TellsWhichLimitItWouldExceed) {
  Bench bench;
  bench.prepare();
  const auto refused = [&](std::int64_t distance_nL, std::uint32_t flow_uL_per_s) {
    EXPECT_FALSE(bench.ask(wire::Jog{0, Bench::kLease, distance_nL, flow_uL_per_s}));
    EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::limit_exceeded);
    return bench.heard.naks.back().limit;
  };
  EXPECT_EQ(refused(7'100'000'000, 1000), wire::Limit::travel);
  EXPECT_EQ(refused(-1'000'000, 1000), wire::Limit::home);
  EXPECT_EQ(refused(1'000, 1000), wire::Limit::stroke_at_least);
  EXPECT_EQ(refused(1'000'000, 2'000'000), wire::Limit::flow);
  EXPECT_FALSE(bench.ask(wire::Jog{0, Bench::kLease + 1, 1'000'000, 1000}));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::no_lease);
  EXPECT_EQ(bench.state(), State::homed);
}

TEST(Lease, NothingMovesByTheOrderOfAnother) {
  Bench bench;
  bench.connect();
  ASSERT_TRUE(bench.ask(wire::Configure::example()));
  const auto expect_refused = [&](const auto& order, State state) {
    EXPECT_FALSE(bench.ask(order));
    EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::no_lease);
    bench.run_for(microseconds(100'000));
    EXPECT_EQ(bench.state(), state);
  };
  const auto stood_at = bench.rig.mechanical_microsteps();
  expect_refused(wire::Home{0, Bench::kLease + 1}, State::unhomed);
  expect_refused(wire::Jog{0, Bench::kLease + 1, 1'000'000, 1000}, State::unhomed);
  EXPECT_EQ(bench.rig.mechanical_microsteps(), stood_at);
  ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(60'000'000)));
  bench.add_segment(wire::Waveform::parabolic, 2, 2'000'000, 1'500'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  ASSERT_EQ(bench.state(), State::armed);
  expect_refused(wire::Start{0, Bench::kLease + 1}, State::armed);
  EXPECT_EQ(bench.rig.position_microsteps(), 0);
  EXPECT_TRUE(bench.ask(wire::Start{0, Bench::kLease})) << "by its own lease it runs";
}

TEST(Jog, UnhomedItCreepsAwayFromAClosedSwitchButNotTowardsIt) {
  Bench bench(standing_at(-20));
  bench.connect();
  ASSERT_TRUE(bench.ask(wire::Configure::example()));
  EXPECT_FALSE(bench.ask(wire::Jog{0, Bench::kLease, -1'000'000, 1000}));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::home_switch_closed);
  EXPECT_FALSE(bench.ask(wire::Jog{0, Bench::kLease, 1'000'000, 6'000}));
  EXPECT_EQ(bench.heard.naks.back().allowed, 5'000) << "the speed of homing";
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, 1'000'000, 5'000}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::unhomed; }, microseconds(2'000'000)));
  EXPECT_EQ(bench.rig.mechanical_microsteps(), -20 + 128);
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, -2'000'000, 5'000}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::faulted; }, microseconds(2'000'000)));
  EXPECT_EQ(bench.heard.faults.back().fault, Fault::home_switch);
  EXPECT_EQ(bench.rig.mechanical_microsteps(), 0) << "cut off at the switch";
}

TEST(Jog, AMotorThatTurnsTheWrongWayIsCutOffAtTheFarLimit) {
  Bench bench;
  bench.prepare();
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, 20'000'000, 20'000}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(5'000'000)));
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, -10'000'000, 20'000}));
  bench.run_for(microseconds(200'000));
  ASSERT_EQ(bench.state(), State::jogging);
  const std::int32_t there = bench.rig.mechanical_microsteps();
  bench.rig.set_far_limit(true);
  bench.run_for(microseconds(50'000));
  EXPECT_EQ(bench.rig.controller().motion().safety().fault(), Fault::limit_switch);
  EXPECT_EQ(bench.rig.mechanical_microsteps(), there);
  // From the switch it withdraws.
  ASSERT_TRUE(bench.ask(wire::ClearFault{}));
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, -1'000'000, 5'000}));
  bench.run_until([&] { return bench.state() == State::unhomed; }, microseconds(5'000'000));
  EXPECT_EQ(bench.state(), State::unhomed);
  EXPECT_EQ(there - bench.rig.mechanical_microsteps(), 128);
}

TEST(Jog, StopsUnderControlForAStopAndForASilentHost) {
  Bench bench;
  bench.prepare();
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, 50'000'000, 20'000}));
  bench.run_for(microseconds(700'000));
  ASSERT_TRUE(bench.ask(wire::StopNow{}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(300'000)));
  const std::int32_t here = bench.rig.position_microsteps();
  EXPECT_GT(here, 1000);
  EXPECT_EQ(bench.rig.mechanical_microsteps() - here, kReference);
  ASSERT_TRUE(bench.ask(wire::Jog{0, Bench::kLease, 50'000'000, 20'000}));
  bench.run_for(microseconds(400'000));
  bench.heartbeats = false;
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::faulted; }, microseconds(500'000)));
  EXPECT_EQ(bench.rig.controller().motion().safety().fault(), Fault::lease_lost);
  EXPECT_TRUE(bench.ask(wire::ClearFault{}));
  EXPECT_EQ(bench.state(), State::homed) << "the position is still known";
  EXPECT_EQ(bench.rig.mechanical_microsteps() - bench.rig.position_microsteps(), kReference);
}

TEST(RestToRestMove, EveryStepIsInOrderWithinSpeedAndAcceleration) {
  for (const std::uint32_t count : {1U, 2U, 3U, 10U, 641U, 5000U})
    for (const std::uint64_t speed : {1U, 160U, 641U, 20'000U})
      for (const std::uint64_t acceleration : {100U, 10'000U, 218'000U}) {
        const RestToRestMove move(count, speed, acceleration);
        const auto v = static_cast<double>(speed), a = static_cast<double>(acceleration);
        double before_s = -1;
        for (std::uint32_t k = 0; k < count; ++k) {
          const double t_s = static_cast<double>(move.time_of(k).count) / kTicksPerSecond;
          ASSERT_GT(t_s, 0);
          // From rest, (k + 1/2) steps need at least √(2 (k + 1/2) / a), and 1/v each.
          ASSERT_GE(t_s * 1.000001, std::min(std::sqrt((2 * k + 1) / a), (k + 0.5) / v)) << count << " " << k;
          if (k > 0) {
            ASSERT_GE((t_s - before_s) * 1.0001, 1 / v);
          }
          before_s = t_s;
        }
        const double end_s = static_cast<double>(move.duration().count) / kTicksPerSecond;
        ASSERT_GT(end_s, before_s);
        ASSERT_LE(end_s, count / v + v / a + std::sqrt(8 * count / a) + 2 / v);
      }
}

}  // namespace
}  // namespace diastole::firmware
