// The image's own edges against the waveforms as the documentation defines them.

#include <algorithm>
#include <cmath>
#include <vector>

#include "firmware/core/profiles/profile.hpp"
#include "protocol/wire/wire_text.hpp"
#include "tests/firmware/analytic_profiles.hpp"
#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"
#include "tools/benchmarks/step_rate.hpp"

namespace diastole::step_path_test {
namespace {

using firmware::Real;
using sim_controller::Pin;

int64_t ticks_between(uint64_t from_ns, uint64_t to_ns) {
  return std::llround((static_cast<double>(to_ns) - static_cast<double>(from_ns)) * 0.084);
}

struct Rises {
  std::vector<uint64_t> steps_ns, triggers_ns;
};

/// A run of the trial on the image, from its first TTL on.
Rises run(const StepRateTrial& trial) {
  EmulatedSession session(image);
  Rises rises;
  if (!session.prepare(fine_stepping())) return rises;
  (void)session.ask(segment_of(trial));
  (void)session.ask(wire::Arm::example());
  session.on_edge = [&](const sim_controller::PinEdge& edge) {
    if (edge.value == 1 && edge.pin == Pin::step) rises.steps_ns.push_back(edge.time_ns);
    if (edge.value == 1 && edge.pin == Pin::ttl) rises.triggers_ns.push_back(edge.time_ns);
  };
  (void)session.start();
  session.run_until([&] { return session.ended.has_value(); }, 60'000'000'000);
  EXPECT_EQ(session.fault, wire::Fault::none);
  EXPECT_EQ(session.statistics().missed_deadlines, 0U);
  return rises;
}

class StepTimes : public testing::TestWithParam<StepRateTrial> {};

/// Ideal ticks from the first cycle's start, against the edges' from the first trigger.
TEST_P(StepTimes, AreTheAnalyticCrossingsRoundedToATick) {
  NEEDS_IMAGE();
  const StepRateTrial& trial = GetParam();
  const auto analytic = firmware::analytic_profiles().find(std::string(wire::waveform_name(trial.waveform)));
  ASSERT_NE(analytic, firmware::analytic_profiles().end());
  const wire::AddSegment segment = segment_of(trial);
  const uint32_t count = segment.stroke_nL;
  const auto period = static_cast<Real>(segment.period_us) * 84;
  const auto ideal = [&](std::size_t step) {
    const std::size_t cycle = step / (2 * count), k = step % (2 * count);
    const bool rising = k < count;
    const Real y = static_cast<Real>(2 * (rising ? k : 2 * count - 1 - k) + 1) / (2.0L * count);
    const Real phase = rising ? analytic->second.phase_rising(y) : analytic->second.phase_falling(y);
    return (static_cast<Real>(cycle) + phase) * period;
  };
  const Rises rises = run(trial);
  ASSERT_EQ(rises.steps_ns.size(), 2U * count * trial.cycles);
  ASSERT_EQ(rises.triggers_ns.size(), trial.cycles);
  const auto first = std::llround(ideal(0));
  for (std::size_t step = 0; step < rises.steps_ns.size(); ++step) {
    const int64_t found = first + ticks_between(rises.triggers_ns[0], rises.steps_ns[step]);
    ASSERT_LE(std::abs(static_cast<Real>(found) - ideal(step)), 0.51L) << "step " << step;
  }
  for (std::size_t cycle = 0; cycle < trial.cycles; ++cycle)
    ASSERT_EQ(rises.triggers_ns[cycle], rises.steps_ns[2 * count * cycle]) << "TTL at the tick of the step";
}

std::string name_of(const testing::TestParamInfo<StepRateTrial>& tested) {
  return std::string(wire::waveform_name(tested.param.waveform)) + "_" +
         std::to_string(static_cast<int>(tested.param.peak_rate_Hz / 1000)) + "kHz";
}

std::vector<StepRateTrial> trials() {
  std::vector<StepRateTrial> all;
  for (const double rate_Hz : {30e3, 200e3}) {
#define DIASTOLE_PROFILE(number, name)  \
  if (firmware::name##_profile.moves()) \
    all.push_back({.waveform = wire::Waveform::name, .peak_rate_Hz = rate_Hz, .period_s = 0.4, .cycles = 2});
#include "protocol/wire/waveform_list.inc"
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Profiles, StepTimes, testing::ValuesIn(trials()), name_of);

/// At 30,000 steps/s exactly 2800 ticks lie between two steps of a trapezoid's flank.
TEST(Jitter, IsZeroAt30kHz) {
  NEEDS_IMAGE();
  const Rises rises = run({.peak_rate_Hz = 30'000, .period_s = 1.0, .cycles = 2});
  std::size_t even = 0;
  for (std::size_t i = 1; i < rises.steps_ns.size(); ++i) {
    const int64_t phase_us =
        static_cast<int64_t>(rises.steps_ns[i] - rises.triggers_ns[0]) / 1000 % 1'000'000;
    const bool on_flank =
        (phase_us > 52'000 && phase_us < 198'000) || (phase_us > 552'000 && phase_us < 698'000);
    if (!on_flank) continue;
    ASSERT_EQ(ticks_between(rises.steps_ns[i - 1], rises.steps_ns[i]), 2800) << "step " << i;
    ++even;
  }
  EXPECT_GT(even, 17'000U);
}

}  // namespace
}  // namespace diastole::step_path_test
