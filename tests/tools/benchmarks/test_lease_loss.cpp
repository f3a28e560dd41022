#include <algorithm>
#include <cmath>
#include <ostream>
#include <vector>

#include "firmware/core/program.hpp"
#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"
#include "tools/benchmarks/step_rate.hpp"

namespace diastole::step_path_test {
namespace {

using sim_controller::Pin;

struct Step {
  uint64_t time_ns;
  bool inflate;
};

struct Case {
  const char* name;
  wire::Configure configure;
  wire::AddSegment segment;
};

std::ostream& operator<<(std::ostream& out, const Case& motion) { return out << motion.name; }

/// The motion of the paper's gel, and 200,000 steps/s; braking as hard as is allowed.
std::vector<Case> cases() {
  wire::Configure fast = fine_stepping();
  fast.acceleration_uL_per_s2 = 3'000;
  return {
      {"paper", wire::Configure::example(), {0, wire::Waveform::parabolic, 30, 40'000'000, 0, 1'200'000}},
      {"200kHz", fast, segment_of({.waveform = wire::Waveform::sawtooth, .period_s = 2.0, .cycles = 20})}};
}

class LeaseLoss : public testing::TestWithParam<Case> {
 public:
  /// Steps of a run that falls silent `after_ms` after its first trigger; the last heartbeat's time comes back.
  std::vector<Step> run_until_silent(uint64_t after_ms, uint64_t& silent_ns) {
    std::vector<Step> steps;
    EmulatedSession session(image);
    if (!session.prepare(GetParam().configure)) return steps;
    bool inflate = true;  // homing ends that way
    session.on_edge = [&](const sim_controller::PinEdge& edge) {
      if (edge.pin == Pin::dir) inflate = edge.value == 1;
      if (edge.pin == Pin::step && edge.value == 1) steps.push_back({edge.time_ns, inflate});
    };
    (void)session.ask(GetParam().segment);
    (void)session.ask(wire::Arm::example());
    (void)session.start();
    session.run_until([&] { return session.triggers > 0; }, 5'000 * ms);
    session.run_for(after_ms * ms);
    session.heartbeats = false;
    silent_ns = session.now_ns();
    session.run_for(700 * ms);
    EXPECT_EQ(session.fault, wire::Fault::lease_lost);
    EXPECT_EQ(session.state, wire::State::faulted);
    return steps;
  }

  [[nodiscard]] double allowed_steps_per_s2() const {
    const wire::Configure& configure = GetParam().configure;
    return static_cast<double>(firmware::Settings(configure).stop_steps_per_s2());
  }
};

/// Change of speed over one step, beyond what the rounding of two edges to a tick explains, in steps/s².
double braking(const Step& a, const Step& b, const Step& c) {
  const double first_s = static_cast<double>(b.time_ns - a.time_ns) * 1e-9;
  const double second_s = static_cast<double>(c.time_ns - b.time_ns) * 1e-9;
  const double change = std::abs(1 / first_s - 1 / second_s) / ((first_s + second_s) / 2);
  const double tick_s = 1.0 / 84e6, shortest_s = std::min(first_s, second_s);
  return change - 2 * 1.1 * tick_s / (shortest_s * shortest_s * shortest_s);
}

TEST_P(LeaseLoss, ComesToRestUnderControlWithin500ms) {
  NEEDS_IMAGE();
  for (const uint64_t after_ms : {410U, 1180U, 1777U}) {
    SCOPED_TRACE(after_ms);
    uint64_t silent_ns = 0;
    const std::vector<Step> steps = run_until_silent(after_ms, silent_ns);
    ASSERT_GT(steps.size(), 100U);
    EXPECT_GT(steps.back().time_ns, silent_ns + 100 * ms) << "it went on until the lease was lost";
    EXPECT_LE(steps.back().time_ns, silent_ns + 500 * ms);
    for (std::size_t i = 2; i < steps.size(); ++i) {
      if (steps[i].time_ns < silent_ns) continue;
      if (steps[i].inflate != steps[i - 1].inflate || steps[i - 1].inflate != steps[i - 2].inflate) continue;
      ASSERT_LE(braking(steps[i - 2], steps[i - 1], steps[i]), 1.01 * allowed_steps_per_s2()) << "step " << i;
    }
    // From its last step to rest half a step further on: v² < 2 a.
    const double last_s = static_cast<double>(steps.back().time_ns - steps[steps.size() - 2].time_ns) * 1e-9;
    EXPECT_LE(1 / (last_s * last_s), 2 * allowed_steps_per_s2());
  }
}

INSTANTIATE_TEST_SUITE_P(Motions, LeaseLoss, testing::ValuesIn(cases()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace diastole::step_path_test
