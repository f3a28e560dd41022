// The R-wave as the image's DAC plays it: a triangle of 30 ms, 2.5 V at the pin, 20 mV behind the divider.

#include <algorithm>
#include <vector>

#include "firmware/core/r_wave.hpp"
#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"
#include "tools/benchmarks/step_rate.hpp"

namespace diastole::step_path_test {
namespace {

using sim_controller::Pin;

struct Sample {
  double time_ms;  ///< from the wave's first code
  double code;
};

double code_of(int32_t scanner_uV) {
  return scanner_uV * double{firmware::kRWaveDivider} * firmware::kDacFullScale / firmware::kDacFullScale_uV;
}

/// The waves of three cycles at 200,000 steps/s.
std::vector<std::vector<Sample>> played_waves() {
  EmulatedSession session(image);
  std::vector<std::vector<Sample>> waves;
  if (!session.prepare(fine_stepping())) return waves;
  (void)session.ask(segment_of({.period_s = 0.4, .cycles = 3}));
  (void)session.ask(wire::Arm::example());
  int32_t before_uV = 0;
  uint64_t began_ns = 0;
  session.on_edge = [&](const sim_controller::PinEdge& edge) {
    if (edge.pin != Pin::rwave_uV) return;
    if (before_uV == 0) {
      waves.emplace_back();
      began_ns = edge.time_ns;
    }
    waves.back().push_back({static_cast<double>(edge.time_ns - began_ns) * 1e-6, code_of(edge.value)});
    before_uV = edge.value;
  };
  (void)session.start();
  session.run_until([&] { return session.ended.has_value(); }, 10'000'000'000);
  return waves;
}

/// The code held at a time, as an oscilloscope would show it.
double code_at(const std::vector<Sample>& wave, double time_ms) {
  const auto after = std::ranges::upper_bound(wave, time_ms, {}, &Sample::time_ms);
  return after == wave.begin() ? 0 : std::prev(after)->code;
}

TEST(RWave, IsATriangleOf30msWithinTwoPercent) {
  NEEDS_IMAGE();
  constexpr double kPeak = 2.5 / 3.3 * 4095, kTwoPercent = 0.02 * kPeak;
  const auto waves = played_waves();
  ASSERT_EQ(waves.size(), 3U);
  for (const std::vector<Sample>& wave : waves) {
    const auto top = std::ranges::max_element(wave, {}, &Sample::code);
    EXPECT_NEAR(top->code, kPeak, kTwoPercent);
    EXPECT_NEAR(top->time_ms, 15.0, 0.11);
    EXPECT_NEAR(wave.back().time_ms, 30.0, 0.11);
    EXPECT_EQ(wave.back().code, 0);
    for (double t = 0.05; t < 15; t += 0.1) {
      ASSERT_NEAR(code_at(wave, t), kPeak * t / 15, kTwoPercent) << t << " ms";
      ASSERT_NEAR(code_at(wave, t), code_at(wave, 29.9 - t), kTwoPercent) << t << " ms: symmetry";
    }
  }
}

}  // namespace
}  // namespace diastole::step_path_test
