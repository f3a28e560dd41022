#include <gtest/gtest.h>

#include <set>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::Fault;
using wire::Limit;
using wire::Refusal;
using wire::RunEnd;
using wire::State;
using wire::Waveform;

/// Armed with thirty of the paper's cycles and started; the first second is rest.
void start_paper_run(Bench& bench) {
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 30, 40'000'000, 1'200'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
}

Ticks last_step(const std::vector<Edge>& edges) {
  Ticks last{-1};
  for (const Edge& edge : edges)
    if (edge.signal == Signal::STEP && edge.value == 1) last = edge.tick;
  return last;
}

TEST(States, OnlyTheDrawnTransitionsExist) {
  std::set<std::pair<State, State>> drawn{
      {State::unhomed, State::homing}, {State::homed, State::homing},     {State::armed, State::homing},
      {State::homing, State::homed},   {State::armed, State::homed},      {State::running, State::homed},
      {State::stopping, State::homed}, {State::faulted, State::homed},    {State::homed, State::armed},
      {State::armed, State::running},  {State::running, State::stopping}, {State::faulted, State::unhomed},
      {State::homed, State::unhomed},  {State::armed, State::unhomed},    {State::homing, State::unhomed},
      {State::homed, State::jogging},  {State::unhomed, State::jogging},  {State::jogging, State::homed},
      {State::jogging, State::unhomed}};
  for (int from = 0; from <= static_cast<int>(wire::kLastState); ++from)
    for (int to = 0; to <= static_cast<int>(wire::kLastState); ++to) {
      const std::pair pair{static_cast<State>(from), static_cast<State>(to)};
      const bool expected =
          drawn.contains(pair) || (pair.second == State::faulted && pair.first != State::faulted);
      EXPECT_EQ(may_follow(pair.first, pair.second), expected) << from << " -> " << to;
    }
}

TEST(Safety, NothingMovesBeforeHoming) {
  Bench bench;
  bench.connect();
  EXPECT_FALSE(bench.ask(wire::Home{0, Bench::kLease}));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::not_configured);
  EXPECT_TRUE(bench.ask(wire::Configure::example()));
  bench.add_segment(Waveform::parabolic, 1, 1'000'000, 1'000'000);
  EXPECT_FALSE(bench.ask(wire::Arm::example()));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::wrong_state);
  EXPECT_FALSE(bench.ask(wire::Start{0, Bench::kLease}));
  EXPECT_EQ(last_step(bench.rig.take_edges()).count, -1);
}

TEST(Safety, HomingFindsTheSwitchFromEitherSide) {
  for (const std::int32_t from : {400, 5000, 0, -300}) {
    RecordedController::Options options;
    options.board.mechanics.start_steps = from;
    Bench bench(options);
    bench.prepare();
    EXPECT_EQ(bench.state(), State::homed);
    EXPECT_EQ(bench.rig.position_microsteps(), 0);
    EXPECT_EQ(bench.rig.mechanical_microsteps(), 1 + static_cast<std::int32_t>(kHomeClearance_steps)) << from;
  }
}

TEST(Safety, HomingWithoutASwitchGivesUpWithinTheTravel) {
  RecordedController::Options options;
  options.board.mechanics.start_steps = 1'000'000;
  Bench bench(options);
  wire::Configure configure = wire::Configure::example();
  configure.travel_uL = 50'000;
  bench.prepare(configure);
  EXPECT_EQ(bench.state(), State::faulted);
  ASSERT_FALSE(bench.heard.faults.empty());
  EXPECT_EQ(bench.heard.faults[0].fault, Fault::homing_failed);
}

TEST(Safety, ARefusedProgramNamesItsLimitOverTheWire) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 1, 40'000'000, 1'200'000);
  bench.add_segment(Waveform::parabolic, 1, 100'000'000, 600'000);
  EXPECT_FALSE(bench.ask(wire::Arm::example()));
  const wire::Nak& nak = bench.heard.naks.back();
  EXPECT_EQ(nak.refusal, Refusal::limit_exceeded);
  EXPECT_EQ(nak.limit, Limit::acceleration);
  EXPECT_EQ(nak.segment, 1);
  EXPECT_EQ(nak.allowed, 1'700'000);
  EXPECT_NEAR(static_cast<double>(nak.asked), 16 * 100'000 / 0.36, 2);
  EXPECT_EQ(bench.state(), State::homed);
}

TEST(Safety, AcceptedProgramsReportTheirSegments) {
  Bench bench;
  bench.prepare();
  for (int i = 0; i < 40; ++i)
    bench.add_segment(Waveform::parabolic, 2, 20'000'000, 1'000'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  EXPECT_TRUE(bench.heard.planned.empty()) << "the Ack comes first";
  bench.run_for(microseconds(500'000));
  ASSERT_EQ(bench.heard.planned.size(), 40U);
  EXPECT_EQ(bench.heard.planned[39].segment, 39);
  EXPECT_EQ(bench.heard.planned[39].start_us, 1'000'000U + 39 * 2'000'000U);
}

TEST(Safety, StartNeedsTheLease) {
  Bench bench;
  bench.prepare();
  bench.add_segment(Waveform::parabolic, 1, 1'000'000, 1'000'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  EXPECT_FALSE(bench.ask(wire::Start{0, Bench::kLease + 1}));
  EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::no_lease);
  bench.heartbeats = false;
  bench.run_for(microseconds(1'000'000));
  EXPECT_FALSE(bench.ask(wire::Start{0, Bench::kLease}));
}

class LeaseLoss : public testing::TestWithParam<int> {};

TEST_P(LeaseLoss, StopsUnderControlWithin500ms) {
  Bench bench;
  start_paper_run(bench);
  bench.run_for(microseconds(2'400'000 + GetParam() * 67'000));
  (void)bench.rig.take_edges();
  bench.cable = false;
  const Ticks unplugged = bench.rig.now();
  bench.run_for(microseconds(1'500'000));
  EXPECT_EQ(bench.state(), State::faulted);
  const auto edges = bench.rig.take_edges();
  EXPECT_LE((last_step(edges) - unplugged).count, microseconds(500'000).count);
  // Under control: no two successive intervals of the end differ by more than the deceleration explains.
  std::vector<Ticks> steps;
  for (const Edge& edge : edges)
    if (edge.signal == Signal::STEP && edge.value == 1) steps.push_back(edge.tick);
  ASSERT_GT(steps.size(), 20U);
  const double limit = static_cast<double>(Settings(wire::Configure::example()).stop_steps_per_s2());
  for (std::size_t i = steps.size() - 10; i < steps.size(); ++i) {
    const double before =
        static_cast<double>(kTicksPerSecond) / static_cast<double>((steps[i - 1] - steps[i - 2]).count);
    const double dt = static_cast<double>((steps[i] - steps[i - 1]).count) / kTicksPerSecond;
    EXPECT_LE((before - 1 / dt) / dt, 3 * limit);
  }
  // The position is still known and motion does not start by itself when the cable is back.
  bench.cable = true;
  const std::int32_t position = bench.rig.mechanical_microsteps();
  bench.run_for(microseconds(1'000'000));
  EXPECT_EQ(bench.rig.mechanical_microsteps(), position);
  ASSERT_FALSE(bench.heard.faults.empty());
  EXPECT_EQ(bench.heard.faults[0].fault, Fault::lease_lost);
  ASSERT_FALSE(bench.heard.ended.empty());
  EXPECT_EQ(bench.heard.ended[0].reason, RunEnd::lease_lost);
  EXPECT_TRUE(bench.ask(wire::ClearFault{}));
  EXPECT_EQ(bench.state(), State::homed);
  EXPECT_EQ(bench.rig.mechanical_microsteps() - bench.rig.position_microsteps(),
            1 + static_cast<std::int32_t>(kHomeClearance_steps));
}

INSTANTIATE_TEST_SUITE_P(Phases, LeaseLoss, testing::Range(0, 18, 1));

enum class Cut { estop, far_limit, halt };
class ImmediateCut : public testing::TestWithParam<Cut> {};

TEST_P(ImmediateCut, LeavesAtMostOneStepAtAnyPhase) {
  Bench bench;
  std::mt19937 random(5);
  start_paper_run(bench);
  for (int trial = 0; trial < 20; ++trial) {
    bench.run_for(microseconds(1'600'000 + static_cast<std::int64_t>(random() % 2'000'000)));
    ASSERT_EQ(bench.state(), State::running);
    bench.rig.advance_to(bench.rig.now() + Ticks{static_cast<std::int64_t>(random() % 80'000)});
    (void)bench.rig.take_edges();
    const Ticks cut = bench.rig.now();
    if (GetParam() == Cut::estop) bench.rig.set_estop(true);
    if (GetParam() == Cut::far_limit) bench.rig.set_far_limit(true);
    if (GetParam() == Cut::halt) bench.request(wire::Halt{});
    bench.run_for(microseconds(200'000));
    ASSERT_EQ(bench.state(), State::faulted);
    const auto edges = bench.rig.take_edges();
    const Ticks latest = GetParam() == Cut::halt ? microseconds(3'000) : Ticks{0};
    EXPECT_LE((last_step(edges) - cut).count, latest.count);
    if (GetParam() != Cut::halt) {
      EXPECT_TRUE(std::any_of(edges.begin(), edges.end(), [](const Edge& edge) {
        return edge.signal == Signal::ENABLE && edge.value == 0;
      }));
    }
    // Latched until cleared, and the position is not trusted afterwards.
    EXPECT_FALSE(bench.ask(wire::Start{0, Bench::kLease}));
    if (GetParam() == Cut::estop) {
      EXPECT_FALSE(bench.ask(wire::ClearFault{}));
      EXPECT_EQ(bench.heard.naks.back().refusal, Refusal::estop_pressed);
    }
    bench.rig.set_estop(false);
    bench.rig.set_far_limit(false);
    EXPECT_TRUE(bench.ask(wire::ClearFault{}));
    ASSERT_EQ(bench.state(), State::unhomed);
    ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
    ASSERT_TRUE(bench.run_until([&] { return bench.state() == State::homed; }, microseconds(60'000'000)));
    ASSERT_TRUE(bench.ask(wire::Arm::example()));
    ASSERT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
  }
}

INSTANTIATE_TEST_SUITE_P(Causes, ImmediateCut, testing::Values(Cut::estop, Cut::far_limit, Cut::halt));

TEST(Safety, AStalledMainLoopIsAnUnderrunAndCutsOff) {
  Bench bench;
  start_paper_run(bench);
  bench.run_for(microseconds(1'300'000));
  bench.rig.stall_until(bench.rig.now() + microseconds(30'000));
  bench.run_for(microseconds(200'000));
  EXPECT_EQ(bench.state(), State::faulted);
  ASSERT_FALSE(bench.heard.faults.empty());
  EXPECT_EQ(bench.heard.faults[0].fault, Fault::step_underrun);
  EXPECT_EQ(bench.heard.ended.at(0).reason, RunEnd::faulted);
}

TEST(Safety, AShortStallDisturbsNothing) {
  Bench bench;
  start_paper_run(bench);
  for (int i = 0; i < 200; ++i) {
    bench.run_for(microseconds(20'000));
    bench.rig.stall_until(bench.rig.now() + microseconds(8'000));
  }
  EXPECT_EQ(bench.state(), State::running);
  EXPECT_TRUE(bench.heard.faults.empty());
}

TEST(Stop, AtCycleEndCompletesTheCycleAndReturnsToZero) {
  Bench bench;
  start_paper_run(bench);
  bench.run_for(microseconds(2'800'000));
  EXPECT_TRUE(bench.ask(wire::StopAtCycleEnd{}));
  EXPECT_EQ(bench.state(), State::stopping);
  ASSERT_TRUE(bench.run_until([&] { return !bench.heard.ended.empty(); }, microseconds(5'000'000)));
  EXPECT_EQ(bench.heard.ended[0].reason, RunEnd::stopped_at_cycle_end);
  EXPECT_EQ(bench.heard.ended[0].cycles, 2U);
  EXPECT_EQ(bench.heard.ended[0].triggers, 2U);
  EXPECT_EQ(bench.heard.ended[0].position_microsteps, 0);
  EXPECT_EQ(bench.state(), State::homed);
}

TEST(Stop, NowKeepsThePositionAndTheNextRunStartsFromThere) {
  Bench bench;
  start_paper_run(bench);
  bench.run_for(microseconds(1'400'000));
  EXPECT_TRUE(bench.ask(wire::StopNow{}));
  ASSERT_TRUE(bench.run_until([&] { return !bench.heard.ended.empty(); }, microseconds(2'000'000)));
  EXPECT_EQ(bench.heard.ended[0].reason, RunEnd::stopped_now);
  EXPECT_GT(bench.heard.ended[0].position_microsteps, 0);
  EXPECT_NEAR(bench.heard.positions.back(), bench.heard.ended[0].position_microsteps, 2);
  EXPECT_EQ(bench.state(), State::homed);
  bench.heard.positions.clear();
  bench.run_program();
  ASSERT_EQ(bench.heard.ended.size(), 2U);
  EXPECT_EQ(bench.heard.ended[1].reason, RunEnd::completed);
  EXPECT_EQ(bench.heard.ended[1].position_microsteps, 0);
  EXPECT_TRUE(bench.heard.positions_contiguous);
}

TEST(Stop, DuringRestEndsAtOnce) {
  Bench bench;
  start_paper_run(bench);
  bench.run_for(microseconds(100'000));
  EXPECT_TRUE(bench.ask(wire::StopNow{}));
  ASSERT_TRUE(bench.run_until([&] { return !bench.heard.ended.empty(); }, microseconds(100'000)));
  EXPECT_EQ(bench.heard.ended[0].cycles, 0U);
}

TEST(Status, TellsStateInputsAndCounters) {
  Bench bench;
  start_paper_run(bench);
  bench.run_for(microseconds(3'500'000));
  bench.request(wire::StatusRequest{});
  ASSERT_TRUE(bench.run_until([&] { return !bench.heard.statuses.empty(); }, microseconds(500'000)));
  const wire::Status& status = bench.heard.statuses[0];
  EXPECT_EQ(status.state, State::running);
  EXPECT_EQ(status.inputs, 8);
  EXPECT_EQ(status.triggers, 3U);
  EXPECT_EQ(status.cycle, 3U);
  EXPECT_EQ(status.crc_errors, 0U);
}

TEST(Safety, WithoutItsCrystalNothingMovesUntilTheNextStart) {
  RecordedController::Options options;
  options.board.clock_sound = false;
  Bench bench(options);
  bench.connect();
  EXPECT_EQ(bench.state(), wire::State::faulted);
  bench.request(wire::StatusRequest{});
  ASSERT_TRUE(bench.run_until([&] { return !bench.heard.statuses.empty(); }, microseconds(1'000'000)));
  EXPECT_EQ(bench.heard.statuses.back().fault, wire::Fault::clock);
  EXPECT_FALSE(bench.ask(wire::ClearFault{}));
  EXPECT_FALSE(bench.ask(wire::Home{0, Bench::kLease}));
  EXPECT_EQ(bench.state(), wire::State::faulted);
}

}  // namespace
}  // namespace diastole::firmware
