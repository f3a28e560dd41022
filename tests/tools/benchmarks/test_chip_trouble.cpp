// Peripherals in trouble during a run at 100,000 steps/s: noise on the serial line, a DMA stream that hangs.

#include <algorithm>
#include <array>
#include <random>

#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"
#include "tools/benchmarks/step_rate.hpp"

namespace diastole::step_path_test {
namespace {

constexpr uint64_t ms = 1'000'000;  // ns
const StepRateTrial disturbed_run{.peak_rate_Hz = 100e3, .period_s = 0.4, .cycles = 3};

bool begin(EmulatedSession& session) {
  return session.prepare(fine_stepping()) && session.ask(segment_of(disturbed_run)) &&
         session.ask(wire::Arm::example()) && session.start();
}

TEST(SerialNoise, WithoutStopBitsCostsNoStepAndNoAnswer) {
  NEEDS_IMAGE();
  EmulatedSession session(image);
  ASSERT_TRUE(begin(session));
  const uint64_t steps_before = session.steps;
  std::mt19937 random(2026);
  int asked = 0, answered = 0;
  for (; !session.ended && session.fault == wire::Fault::none && asked < 400; ++asked) {
    std::array<uint8_t, 7> noise{};
    for (auto& byte : noise)
      byte = static_cast<uint8_t>(random() % 3 == 0 ? 0 : random());
    session.controller().board().send_unframed(noise);
    session.refused.reset();
    answered += session.ask(wire::ClearFault{}) || session.refused ? 1 : 0;
    session.run_for(5 * ms);
  }
  session.run_until([&] { return session.ended.has_value(); }, 5'000 * ms);
  ASSERT_TRUE(session.ended);
  EXPECT_GT(asked, 50);
  EXPECT_EQ(answered, asked) << "the link repeats what the noise has spoilt";
  EXPECT_EQ(session.steps - steps_before,
            2 * uint64_t{segment_of(disturbed_run).stroke_nL} * disturbed_run.cycles);
  EXPECT_EQ(session.statistics().missed_deadlines, 0U);
  EXPECT_EQ(session.fault, wire::Fault::none);
}

TEST(StuckDma, EndsInAResetWithTheMotorOff) {
  NEEDS_IMAGE();
  EmulatedSession session(image);
  ASSERT_TRUE(begin(session));
  ASSERT_TRUE(session.run_until([&] { return session.triggers == 1; }, 5'000 * ms));
  const size_t resets = session.statistics().resets.size();
  session.controller().board().stick_dma(5);
  uint64_t last_step_ns = 0;
  session.on_edge = [&](const sim_controller::PinEdge& edge) {
    if (edge.pin == sim_controller::Pin::step) last_step_ns = edge.time_ns;
  };
  const uint64_t stuck_ns = session.now_ns();
  session.run_for(2'000 * ms);
  const auto after = session.statistics().resets;
  ASSERT_GT(after.size(), resets);
  EXPECT_EQ(after[resets].cause, "watchdog");
  EXPECT_LE(after[resets].time_ns, stuck_ns + 800 * ms) << "the next trigger, 400 ms later, and the watchdog";
  EXPECT_LE(last_step_ns, after[resets].time_ns);
}

}  // namespace
}  // namespace diastole::step_path_test
