// The long runs: ten million steps, ten thousand cycles. Each takes minutes. (A thousand cuts: the fault table's full counts.)

#include <cmath>
#include <vector>

#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"
#include "tools/benchmarks/step_rate.hpp"

namespace diastole::step_path_test {
namespace {

using sim_controller::Pin;

constexpr uint64_t s = 1'000'000'000;

int64_t ticks_between(uint64_t from_ns, uint64_t to_ns) {
  return std::llround((static_cast<double>(to_ns) - static_cast<double>(from_ns)) * 0.084);
}

TEST(LongRuns, NothingDriftsOverTenMillionSteps) {
  NEEDS_IMAGE();
  const StepRateTrial trial{.period_s = 1.0, .cycles = 125};
  const uint64_t cycle_steps = 2 * uint64_t{segment_of(trial).stroke_nL};
  EmulatedSession session(image);
  ASSERT_TRUE(session.prepare(fine_stepping()));
  const int64_t home = session.controller().position_microsteps();
  ASSERT_TRUE(session.ask(segment_of(trial)) && session.ask(wire::Arm::example()));
  uint64_t first_ns = 0, steps = 0, wrong = 0;
  int64_t cycles = 0;
  session.on_edge = [&](const sim_controller::PinEdge& edge) {
    if (edge.value != 1) return;
    if (edge.pin == Pin::step) ++steps;
    if (edge.pin != Pin::ttl) return;
    if (cycles == 0) first_ns = edge.time_ns;
    if (ticks_between(first_ns, edge.time_ns) != cycles * 84'000'000) ++wrong;
    ++cycles;
  };
  ASSERT_TRUE(session.start());
  ASSERT_TRUE(session.run_until([&] { return session.ended.has_value(); }, 300 * s));
  EXPECT_GE(steps, 10'000'000U);
  EXPECT_EQ(steps, cycle_steps * 125);
  EXPECT_EQ(cycles, 125);
  EXPECT_EQ(wrong, 0U) << "cycles that did not begin at their tick";
  EXPECT_EQ(session.ended->position_microsteps, 0);
  EXPECT_EQ(session.controller().position_microsteps(), home);
  EXPECT_EQ(session.statistics().missed_deadlines, 0U);
}

TEST(LongRuns, TriggersOfTenThousandCyclesStartWithTheirFirstStep) {
  NEEDS_IMAGE();
  constexpr uint32_t kCycles = 10'000;
  EmulatedSession session(image);
  ASSERT_TRUE(session.prepare(fine_stepping()));
  ASSERT_TRUE(session.ask(wire::AddSegment{0, wire::Waveform::parabolic, kCycles, 20, 0, 35'000}));
  ASSERT_TRUE(session.ask(wire::Arm::example()));
  std::vector<uint64_t> ttl_ns, first_steps_ns, waves_ns;
  uint64_t steps = 0;
  int32_t wave_uV = 0;
  session.on_edge = [&](const sim_controller::PinEdge& edge) {
    if (edge.pin == Pin::ttl && edge.value == 1) ttl_ns.push_back(edge.time_ns);
    if (edge.pin == Pin::step && edge.value == 1 && steps++ % 40 == 0) first_steps_ns.push_back(edge.time_ns);
    if (edge.pin != Pin::rwave_uV) return;
    if (wave_uV == 0) waves_ns.push_back(edge.time_ns);
    wave_uV = edge.value;
  };
  ASSERT_TRUE(session.start());
  ASSERT_TRUE(session.run_until([&] { return session.ended.has_value(); }, 400 * s));
  ASSERT_EQ(ttl_ns.size(), kCycles);
  ASSERT_EQ(first_steps_ns.size(), kCycles);
  ASSERT_EQ(waves_ns.size(), kCycles);
  EXPECT_EQ(session.ended->triggers, kCycles);
  EXPECT_EQ(session.ended->r_waves, kCycles);
  for (std::size_t i = 0; i < kCycles; ++i) {
    ASSERT_LE(std::abs(ticks_between(first_steps_ns[i], ttl_ns[i])), 1) << "cycle " << i;
    ASSERT_LE(std::abs(ticks_between(first_steps_ns[i], waves_ns[i])), 1) << "cycle " << i;
  }
}

TEST(LongRuns, TheHighestRateIsSustainedWithTheLineFlooded) {
  NEEDS_IMAGE();
  const StepRateFigures figures =
      measure(image, {.peak_rate_Hz = 400'000, .period_s = 4.0, .cycles = 2, .flood = true});
  EXPECT_EQ(figures.problem, "");
  EXPECT_GE(figures.headroom, 0.01);
}

}  // namespace
}  // namespace diastole::step_path_test
