// Stops at hundreds of moments spread over a whole run: rest, both turning points, ramps, the last moment.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "protocol/wire/wire_text.hpp"
#include "tests/firmware/bench.hpp"
#include "tests/firmware/every_profile.hpp"
#include "tests/sanitized.hpp"

namespace diastole::firmware {
namespace {

using wire::Fault;
using wire::RunEnd;
using wire::State;
using wire::Waveform;

enum class Stop { now, at_cycle_end, lease_loss };

struct Case {
  NamedProfile named;
  Stop stop;
  bool tight;  ///< the allowed acceleration is the motion's own
};

/// Rest, two cycles from 0, a ramp, a cycle from an offset, a ramp back.
Program program_of(const NamedProfile& named) {
  Program program;
  program.segments[program.size++] = named.segment(2, 8'000'000, 0, 800'000);
  program.segments[program.size++] = named.segment(1, 6'000'000, 3'000'000, 700'000);
  program.gate_every = 1;
  program.rest_us = 500'000;
  program.ttl_width_us = 1'000;
  program.position_period_ticks = 280'000;
  return program;
}

wire::Configure limits_of(const Case& asked) {
  wire::Configure configure = wire::Configure::example();
  const Program program = program_of(asked.named);
  if (asked.tight)
    configure.acceleration_uL_per_s2 = static_cast<std::uint32_t>(
        segment_peaks(program.segments[0], Settings(configure)).acceleration_uL_per_s2);
  return configure;
}

struct StepEdge {
  Ticks tick;
  bool inflate;
};

class StopAnywhere : public testing::TestWithParam<Case> {
 public:
  void SetUp() override {
    bench.prepare(limits);
    if (GetParam().named.uploaded != nullptr) bench.upload(0, GetParam().named.uploaded->rises);
    for (std::size_t i = 0; i < program.size; ++i) {
      const Segment& segment = program.segments[i];
      bench.add_segment(segment.waveform, segment.cycles, segment.stroke_nL, segment.period_us,
                        segment.offset_nL);
    }
    const auto stopping_time = check_program(program, settings);
    ASSERT_TRUE(stopping_time.ok());
    silence = microseconds(limits.lease_us - 5'000) - *stopping_time - Motion<RecordingBoard>::kHorizon;
    // The last ramp is as long as that from 0 to the offset.
    length = Planner::segment_offset(program, settings, 1) + microseconds(program.segments[1].period_us) +
             settings.ramp_time(offset());
    collect_steps();
  }

  /// Where the cycles of the second segment begin.
  [[nodiscard]] Steps offset() const {
    const Segment& segment = program.segments[1];
    return settings.steps_of_nL(segment.offset_nL + (segment.moves() ? 0 : segment.stroke_nL));
  }

  /// Starts the program; it first returns to 0, then rests.
  void start() {
    EXPECT_TRUE(bench.ask(wire::Arm{0, program.gate_every, program.rest_us, program.ttl_width_us,
                                    program.position_period_ticks}));
    const Steps position{bench.rig.position_microsteps()};
    EXPECT_TRUE(bench.ask(wire::Start{0, Bench::kLease}));
    run_start = rest_start = bench.rig.controller().motion().run().start();
    if (position != Steps{0}) rest_start += settings.ramp_time(-position);
  }

  void run_to(Ticks tick) {
    while (bench.rig.now() + microseconds(1'000) <= tick)
      bench.run_for(microseconds(1'000));
    bench.rig.advance_to(tick);
  }

  /// Asks for the stop, or falls silent such that the stop begins then; gives the moment of the last word.
  Ticks stop_at(Ticks tick) {
    if (GetParam().stop != Stop::lease_loss) {
      run_to(tick);
      if (GetParam().stop == Stop::now) bench.request(wire::StopNow{});
      if (GetParam().stop == Stop::at_cycle_end) bench.request(wire::StopAtCycleEnd{});
      return tick;
    }
    run_to(tick - silence);
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    EXPECT_TRUE(
        bench.link.send(wire::Heartbeat::kType, wire::encode(wire::Heartbeat{Bench::kLease}, payload)));
    bench.heartbeats = false;
    return bench.rig.now();
  }

  std::vector<StepEdge> collect_steps() {
    std::vector<StepEdge> steps;
    for (const Edge& edge : bench.rig.take_edges()) {
      if (edge.signal == Signal::DIR) inflating = edge.value != 0;
      if (edge.signal == Signal::STEP && edge.value == 1) steps.push_back({edge.tick, inflating});
    }
    return steps;
  }

  /// Neither between steps nor at the end is the motion braked harder than allowed.
  void expect_bounded(const std::vector<StepEdge>& steps) const {
    const auto limit = static_cast<double>(settings.stop_steps_per_s2());
    const auto speed = [&](std::size_t i) {
      return static_cast<double>(kTicksPerSecond) /
             static_cast<double>((steps[i].tick - steps[i - 1].tick).count);
    };
    for (std::size_t i = 2; i < steps.size(); ++i) {
      if (steps[i].inflate != steps[i - 1].inflate || steps[i - 1].inflate != steps[i - 2].inflate) continue;
      const double before = speed(i - 1), after = speed(i);
      const double apart_s = (1 / before + 1 / after) / 2;
      const double of_a_tick = 2 * std::pow(std::max(before, after), 3) / kTicksPerSecond;
      ASSERT_LE(std::abs(before - after) / apart_s, 1.01 * limit + of_a_tick);
    }
    const std::size_t last = steps.size() - 1;
    // From a step to rest half a step further on, the mean speed over the interval before obeys v² < 1.9 a.
    if (steps.size() >= 2 && steps[last].inflate == steps[last - 1].inflate) {
      ASSERT_LE(std::pow(speed(last), 2), 2 * limit);
    }
  }

  void expect_order(Ticks last_word, const std::vector<StepEdge>& steps) const {
    const wire::RunEnded& end = bench.heard.ended.back();
    const Stop stop = GetParam().stop;
    const std::size_t faults = bench.heard.faults.size();
    if (stop == Stop::lease_loss) {
      ASSERT_EQ(end.reason, RunEnd::lease_lost);
      ASSERT_EQ(faults, 1U);
      ASSERT_EQ(bench.heard.faults[0].fault, Fault::lease_lost);
    } else {
      ASSERT_EQ(faults, 0U) << wire::fault_name(bench.heard.faults[0].fault);
      ASSERT_EQ(end.reason, stop == Stop::now ? RunEnd::stopped_now : RunEnd::stopped_at_cycle_end);
      ASSERT_EQ(bench.state(), State::homed);
    }
    if (stop == Stop::at_cycle_end) {
      ASSERT_EQ(end.position_microsteps, 0);
      ASSERT_EQ(end.cycles, end.triggers);
    } else if (!steps.empty()) {
      ASSERT_LE((steps.back().tick - last_word).count, microseconds(500'000).count);
    }
    ASSERT_EQ(bench.heard.started.size(), 1U);
    ASSERT_LE(bench.heard.started[0].tick, end.tick);
    ASSERT_EQ(end.position_microsteps, bench.rig.position_microsteps());
    ASSERT_EQ(bench.rig.mechanical_microsteps() - bench.rig.position_microsteps(),
              1 + static_cast<std::int32_t>(kHomeClearance_steps));
    ASSERT_GE(end.position_microsteps, -1);
    ASSERT_LE(end.position_microsteps, settings.steps_of_nL(9'000'000).count + 1);
  }

  void try_stop(Ticks StopAnywhere::*from, Ticks after) {
    bench.heard = {};
    start();
    const Ticks last_word = stop_at(this->*from + after);
    ASSERT_TRUE(bench.run_until([&] { return !bench.heard.ended.empty(); }, microseconds(6'000'000)));
    bench.run_for(microseconds(20'000));
    const std::vector<StepEdge> steps = collect_steps();
    expect_order(last_word, steps);
    expect_bounded(steps);
    bench.heartbeats = true;
    bench.run_for(microseconds(60'000));
    if (GetParam().stop == Stop::lease_loss) {
      ASSERT_TRUE(bench.ask(wire::ClearFault{}));
      ASSERT_EQ(bench.state(), State::homed);
    }
  }

  Bench bench;
  Program program = program_of(GetParam().named);
  wire::Configure limits = limits_of(GetParam());
  Settings settings{limits};
  Ticks silence;     ///< from the last heartbeat to the stop
  Ticks length;      ///< of the program, from its rest to its end
  Ticks run_start;   ///< of the present run
  Ticks rest_start;  ///< of the present run: after its return to 0
  bool inflating = false;
};

TEST_P(StopAnywhere, EndsInOrderWithinTheLimits) {
  constexpr int stride = sanitized ? 7 : 1;  // of the 499 moments
  std::vector<Ticks> moments;
  for (int i = 0; i < 240; i += stride)
    moments.push_back(microseconds(25'000) + Ticks{(length.count - microseconds(31'000).count) * i / 239});
  // Around bottom, top, bottom, start of the ramp, its end, top, bottom of the second segment.
  const Ticks second = Planner::segment_offset(program, settings, 1);
  for (const Ticks turn :
       {microseconds(500'000), microseconds(900'000), microseconds(1'300'000), microseconds(2'100'000),
        second, second + microseconds(350'000), second + microseconds(700'000)})
    for (int i = -24; i <= 12; i += stride)
      moments.push_back(turn + microseconds(510 * i));
  int tried = 0;
  for (const Ticks moment : moments) {
    if (GetParam().stop == Stop::lease_loss && moment < silence) continue;
    SCOPED_TRACE(std::to_string(moment.count / kTicksPerMicrosecond) + " us after the start of the rest");
    ASSERT_NO_FATAL_FAILURE(try_stop(&StopAnywhere::rest_start, moment));
    ++tried;
  }
  EXPECT_GE(tried, 200 / stride);
}

class StopAtStart : public StopAnywhere {};

TEST_P(StopAtStart, EndsInOrder) {
  for (int i = 0; i < 64; ++i) {
    const Ticks moment = microseconds(500 * i - 17'000);
    SCOPED_TRACE(std::to_string(moment.count / kTicksPerMicrosecond) + " us after the start of the run");
    ASSERT_NO_FATAL_FAILURE(try_stop(&StopAnywhere::run_start, moment));
    // Half of the runs begin at 0.
    if (i % 2 == 1) bench.run_program(wire::Arm::example());
  }
}

std::string name_of(const testing::TestParamInfo<Case>& info) {
  static constexpr const char* kStops[] = {"StopNow", "StopAtCycleEnd", "LeaseLoss"};
  return std::string(info.param.named.name) + kStops[static_cast<int>(info.param.stop)] +
         (info.param.tight ? "AtTheAccelerationLimit" : "");
}

std::vector<Case> cases(std::initializer_list<Stop> stops) {
  std::vector<Case> all;
  for (const NamedProfile& named : every_profile())
    for (const Stop stop : stops)
      for (const bool tight : {false, true})
        if (!tight || named.moves()) all.push_back({named, stop, tight});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Motions, StopAnywhere,
                         testing::ValuesIn(cases({Stop::now, Stop::at_cycle_end, Stop::lease_loss})),
                         name_of);
// Without the lease a run does not start.
INSTANTIATE_TEST_SUITE_P(Motions, StopAtStart, testing::ValuesIn(cases({Stop::now, Stop::at_cycle_end})),
                         name_of);

}  // namespace
}  // namespace diastole::firmware
