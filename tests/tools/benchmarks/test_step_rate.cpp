// What a step may cost and how long interrupts may be, in instructions of the image: deterministic figures, so they
// are asserted. `tools/bench firmware` prints them.

#include "tools/benchmarks/step_rate.hpp"

#include "firmware/core/profiles/profile.hpp"
#include "protocol/wire/wire_text.hpp"
#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"

namespace diastole::step_path_test {
namespace {

using wire::Waveform;

TEST(StepRate, TwoHundredThousandStepsASecondLeaveHeadroomWithTheLineFlooded) {
  NEEDS_IMAGE();
  const StepRateFigures figures = measure(image, {.period_s = 1.0, .flood = true});
  EXPECT_EQ(figures.problem, "");
  EXPECT_NEAR(figures.rate_Hz, 200'000, 100);
  EXPECT_GE(figures.steps, 29'990U);
  EXPECT_LE(figures.instructions, 450);
  EXPECT_GE(figures.headroom, 0.4);
}

TEST(StepRate, TheHighestRateThatCanBeConfiguredIsSustained) {
  NEEDS_IMAGE();
  const StepRateFigures figures = measure(image, {.peak_rate_Hz = 400'000, .period_s = 0.5});
  EXPECT_EQ(figures.problem, "");
  EXPECT_NEAR(figures.rate_Hz, 400'000, 400);
  EXPECT_GE(figures.headroom, 0.05);
}

TEST(StepRate, TwoHundredThousandStepsASecondHoldWithTheWaitStatesThatTheCachesLeave) {
  NEEDS_IMAGE();
  const StepRateTrial trial{.period_s = 0.4, .flood = true, .timing = board_model::FlashTiming::cached};
  const StepRateFigures cached = measure(image, trial);
  EXPECT_EQ(cached.problem, "");
  EXPECT_GE(cached.headroom, 0.3);
  EXPECT_GT(cached.cycles, cached.instructions);
  EXPECT_GT(cached.board.flash_wait_cycles, 0U);
}

TEST(StepRate, WithoutCachesTheQueueRunsDryWhichIsAFaultAndNoLateEdge) {
  NEEDS_IMAGE();
  const StepRateFigures figures =
      measure(image, {.period_s = 0.4, .flood = true, .timing = board_model::FlashTiming::misses});
  EXPECT_EQ(figures.problem, "step_underrun");
  EXPECT_EQ(figures.board.missed_deadlines, 0U);
}

class EveryWaveform : public testing::TestWithParam<Waveform> {};

TEST_P(EveryWaveform, IsPlannedInTimeAt200kHz) {
  NEEDS_IMAGE();
  const StepRateFigures figures =
      measure(image, {.waveform = GetParam(), .period_s = 0.4, .from = 0, .to = 1});
  EXPECT_EQ(figures.problem, "");
}

TEST_P(EveryWaveform, IsPlannedInTimeWithTheWaitStatesThatTheCachesLeave) {
  NEEDS_IMAGE();
  const StepRateFigures figures = measure(image, {.waveform = GetParam(),
                                                  .period_s = 1.0,
                                                  .flood = true,
                                                  .timing = board_model::FlashTiming::cached,
                                                  .from = 0.2,
                                                  .to = 0.3});
  EXPECT_EQ(figures.problem, "");
  EXPECT_GT(figures.board.flash_wait_cycles, 0U);
}

std::vector<Waveform> moving_waveforms() {
  std::vector<Waveform> moving{Waveform::uploaded};
#define DIASTOLE_PROFILE(number, name) \
  if (firmware::name##_profile.moves()) moving.push_back(Waveform::name);
#include "protocol/wire/waveform_list.inc"
  return moving;
}
INSTANTIATE_TEST_SUITE_P(Profiles, EveryWaveform, testing::ValuesIn(moving_waveforms()),
                         [](const auto& tested) { return std::string(wire::waveform_name(tested.param)); });

TEST(StepRate, ARateAboveTheLimitIsRefusedByName) {
  NEEDS_IMAGE();
  EmulatedSession session(image);
  ASSERT_TRUE(session.prepare(fine_stepping()));
  ASSERT_TRUE(session.ask(segment_of({.peak_rate_Hz = 405'000})));
  EXPECT_FALSE(session.ask(wire::Arm::example()));
  ASSERT_TRUE(session.refused);
  EXPECT_EQ(session.refused->refusal, wire::Refusal::limit_exceeded);
  EXPECT_EQ(session.refused->limit, wire::Limit::step_rate);
  EXPECT_EQ(session.refused->asked, 405'000);
  EXPECT_EQ(session.refused->allowed, 400'000);
}

constexpr uint32_t estop_irq = 6, home_irq = 7, r_wave_irq = 16, clock_irq = 28, serial_irq = 39,
                   step_irq = 50;

TEST(Interrupts, TheirWorstCasesAreBounded) {
  NEEDS_IMAGE();
  const StepRateFigures figures = measure_interrupts(image);
  ASSERT_EQ(figures.problem, "");
  EXPECT_GT(figures.worst_instructions(step_irq), 50U);
  EXPECT_LE(figures.worst_instructions(step_irq), 270U) << "a cycle's first step: TTL, R-wave, report";
  EXPECT_LE(figures.worst_instructions(clock_irq), 50U);
  EXPECT_GT(figures.worst_instructions(estop_irq), 0U);
  EXPECT_LE(figures.worst_instructions(estop_irq), 200U);
  EXPECT_LE(figures.worst_instructions(home_irq), 160U);
  EXPECT_LE(figures.worst_instructions(serial_irq), 60U);
  EXPECT_LE(figures.worst_instructions(r_wave_irq), 20U);
  // 2 µs of 168 MHz: the step's own order must be in place half a microsecond ahead.
  EXPECT_LE(figures.worst_latency_cycles(step_irq), 336U);
  // Done that long before the next step is due, 840 cycles later.
  EXPECT_LE(figures.worst_instructions(step_irq) + figures.worst_latency_cycles(step_irq), 840U - 336U);
  EXPECT_LE(figures.worst_latency_cycles(estop_irq), 336U);
}

}  // namespace
}  // namespace diastole::step_path_test
