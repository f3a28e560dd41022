// Any requests, in any order, at any time, with switches and cable playing up: what must hold whatever the
// host does.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using wire::State;

bool moves(State state) {
  return state == State::homing || state == State::running || state == State::stopping ||
         state == State::jogging;
}

/// Every step lies in a state that moves, and none is faster than allowed.
void check_steps(const std::vector<Edge>& edges, const std::vector<wire::StateChanged>& states,
                 const Settings& settings) {
  const std::int64_t fastest = kTicksPerSecond / static_cast<std::int64_t>(settings.allowed_steps_per_s());
  Ticks last{-kTicksPerSecond};
  std::size_t next = 0;
  State state = State::unhomed;
  for (const Edge& edge : edges) {
    if (edge.signal != Signal::STEP || edge.value == 0) continue;
    for (; next < states.size() && states[next].tick < on_wire(edge.tick); ++next)
      state = states[next].to;
    ASSERT_TRUE(moves(state)) << "a step in state " << static_cast<int>(state);
    ASSERT_GE((edge.tick - last).count, fastest - fastest / 50 - 2) << "faster than allowed";
    last = edge.tick;
  }
}

std::uint32_t ttl_rises(const std::vector<Edge>& edges) {
  return static_cast<std::uint32_t>(std::count_if(edges.begin(), edges.end(), [](const Edge& edge) {
    return edge.signal == Signal::TTL && edge.value == 1;
  }));
}

class Monkey {
 public:
  Monkey(Bench& bench, unsigned seed) : bench_(bench), random_(seed) {}

  /// Half of the time what brings the rig nearer to a run, otherwise anything.
  void act() {
    if (draw(2) == 0) return help();
    switch (draw(18)) {
      case 0:
      case 1:
      case 2:
        return bench_.request(wire::Home{0, Bench::kLease});
      case 3:
      case 4:
        return bench_.request(add());
      case 5:
      case 6:
        return bench_.request(arm());
      case 7:
      case 8:
      case 9:
        return bench_.request(wire::Start{0, Bench::kLease});
      case 10:
        return bench_.request(wire::StopNow{});
      case 11:
        return bench_.request(wire::StopAtCycleEnd{});
      case 12:
        return draw(3) == 0 ? bench_.request(wire::ClearProgram{}) : bench_.request(wire::Halt{});
      case 13:
        return bench_.rig.set_estop(draw(3) == 0);
      case 14:
        return bench_.rig.set_far_limit(draw(3) == 0);
      case 15:
      case 16:
        return bench_.request(
            wire::Jog{0, Bench::kLease, static_cast<std::int64_t>(draw(20'000'000)) - 10'000'000,
                      1 + static_cast<std::uint32_t>(draw(draw(2) == 0 ? 5'000 : 200'000))});
      default:
        return bench_.request(wire::ClearFault{});
    }
  }
  Ticks pause() { return microseconds(static_cast<std::int64_t>(1'000 + draw(4) * draw(400'000))); }

 private:
  std::uint32_t draw(std::uint32_t below) { return static_cast<std::uint32_t>(random_() % below); }
  void help() {
    bench_.rig.set_estop(false);
    bench_.rig.set_far_limit(false);
    switch (bench_.state()) {
      case State::faulted:
        return bench_.request(wire::ClearFault{});
      case State::unhomed:
        return bench_.request(wire::Home{0, Bench::kLease});
      case State::homed:
        bench_.request(wire::ClearProgram{});
        bench_.request(wire::AddSegment{0, static_cast<wire::Waveform>(draw(2)), 1 + draw(4),
                                        1'000'000 + draw(30'000'000), draw(10'000'000),
                                        900'000 + draw(500'000)});
        return bench_.request(arm());
      case State::armed:
        return bench_.request(wire::Start{0, Bench::kLease});
      default:
        return bench_.run_for(microseconds(draw(3'000'000)));
    }
  }
  wire::AddSegment add() {
    return {0,
            static_cast<wire::Waveform>(draw(7)),
            1 + draw(3),
            draw(60'000'000),
            draw(20'000'000),
            300'000 + draw(1'500'000)};
  }
  wire::Arm arm() {
    return {0, static_cast<std::uint16_t>(1 + draw(3)), 1'000 + draw(200'000), 10 + draw(20'000), 280'000};
  }

  Bench& bench_;
  std::mt19937 random_;
};

class AnyRequests : public testing::TestWithParam<unsigned> {};

TEST_P(AnyRequests, NeverLeaveTheTravelNorMoveAtRestNorLoseATrigger) {
  RecordedController::Options options;
  options.board.mechanics.start_steps = 100;
  options.board.mechanics.far_limit_steps = 7'800;  // travel and clearance end before it
  Bench bench(options);
  wire::Configure configure = wire::Configure::example();
  configure.travel_uL = 60'000;
  configure.homing_flow_uL_per_s = 50'000;
  const Settings settings(configure);
  bench.prepare(configure);
  Monkey monkey(bench, GetParam());
  const std::int32_t travel = settings.steps_of_nL(60'000'000).count;
  // Seeking home comes to rest beyond the switch: what is in the queue, a turn, and the braking distance.
  const std::uint64_t speed = settings.steps_per_s(configure.homing_flow_uL_per_s);
  ASSERT_LT(speed, settings.hand_steps_per_s());
  const auto overrun =
      static_cast<std::int32_t>(speed / 80 + speed * speed / 2 / settings.stop_steps_per_s2() + 1);
  for (int action = 0; action < 150; ++action) {
    monkey.act();
    bench.run_for(monkey.pause());
    const std::int32_t position = bench.rig.mechanical_microsteps();
    ASSERT_GE(position, -overrun);
    ASSERT_LE(position, 7'801) << "action " << action;
    if (bench.rig.controller().motion().safety().in_run()) {
      ASSERT_GE(position, 1);
      ASSERT_LE(position, travel + static_cast<std::int32_t>(kHomeClearance_steps) + 1)
          << "action " << action;
    }
  }
  bench.rig.set_estop(false);
  bench.run_for(microseconds(20'000'000));
  const std::vector<Edge> edges = bench.rig.take_edges();
  check_steps(edges, bench.heard.states, settings);
  EXPECT_EQ(bench.heard.triggers.size(), ttl_rises(edges));
  EXPECT_LE(bench.heard.started.size(), bench.heard.ended.size());
  EXPECT_EQ(bench.heard.undecodable, 0U);
  EXPECT_EQ(bench.rig.controller().motion().events_lost(), 0U);
  EXPECT_GE(bench.heard.started.size(), 3U) << "the test has to try something";
  EXPECT_GE(bench.heard.triggers.size(), 3U);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AnyRequests, testing::Range(1U, 17U));

}  // namespace
}  // namespace diastole::firmware
