#include "tests/estimator/explain/synthetic_explanation.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace diastole::test {
namespace {

using namespace explain;
using std::numbers::pi;

/// Cycles of a sinusoid; the base model misses a ripple that grows with the flow.
Trace cycles(const std::string& run, double period_s, int count, double peak_kPa) {
  Trace trace;
  trace.run = run;
  trace.channel = "cavity_kPa";
  trace.unit = "kPa";
  trace.noise_sd = 0.03;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, trace.noise_sd);
  const double rest_s = 1.0, rate_Hz = 100.0;
  const auto samples = static_cast<size_t>((2 * rest_s + period_s * count) * rate_Hz);
  for (int k = 0; k < count; ++k)
    trace.trigger_s.push_back(rest_s + period_s * k);
  for (size_t i = 0; i < samples; ++i) {
    const double t = static_cast<double>(i) / rate_Hz;
    const bool moving = t >= rest_s && t < rest_s + period_s * count;
    const double turn = 2 * pi * (t - rest_s) / period_s;
    const double volume_mL = moving ? 20 * (1 - std::cos(turn)) : 0.0;
    const double elastic = peak_kPa * volume_mL / 40;
    const double ripple = moving ? 0.12 * std::sin(turn) + 0.05 * std::sin(5 * turn) : 0.0;
    trace.time_s.push_back(t);
    trace.cavity_mL.push_back(volume_mL);
    trace.before.push_back(elastic);
    trace.after.push_back(elastic - ripple);
    trace.measured.push_back(elastic - ripple + noise(random));
  }
  trace.measured[samples / 2] = std::numeric_limits<double>::quiet_NaN();
  return trace;
}

}  // namespace

Explanation explained_hose() {
  Explanation e;
  e.study = "gel.study.toml";
  e.verdict = Verdict::named;
  e.summary =
      "The hose swells more than its description says: pressure waves travel in it at 61 m/s, not 400. With "
      "that the "
      "model predicts the sweep, which was not fitted, to within 1.1 times the noise.";
  e.effects = {{"hose-compliance", {{"wave_speed_m_s", 61.2, 2.1, {58.0, 65.0}, "m/s"}}, {}}};
  e.where = {{"drive", "sweep.run.h5", "pump_kPa", 2, {{0.4, 0.6}}, {{2.0, 6.0}}, "", 31.5, 1e-9},
             {"drive", "baseline.run.h5", "cavity_kPa", 0, {}, {}, "", 12.0, 2e-4}};
  e.gap = {14.2, 1.1, 1.0, 0.992, {"sweep.run.h5"}};
  e.next_experiment = NextExperiment{
      "format = \"diastole-experiment\"\nversion = 1\n\n[[segment]]\nwaveform = "
      "\"sinusoidal\"\nstroke_mL = 20.0\nperiod_s = 1.25\ncycles = 10\n",
      {"hose-compliance", "air-bubble-pump"},
      7.2,
      "Fast small strokes tell a swelling hose from a bubble beside it."};
  e.study_after = "explained.study.toml";
  e.evidence = {{{"hose-compliance"}, 5120.4, true, 1, 2210.0, "named"},
                {{"air-bubble-pump"}, 4987.1, true, 1, 1100.0, "refuted: predicts the sweep worse by 1110"},
                {{"hose-compliance", "sensor-drift"}, 5121.9, true, 2, 2209.1, "not needed"},
                {{"viscoelasticity"}, 310.2, false, 2, std::nullopt, "too weak"},
                {{"clock-skew"}, 0.7, false, 1, std::nullopt, "not needed"}};
  e.shifts = {{"C1_kPa", 7.93, 0.05, 8.78, 0.04}};
  e.steps = {{"", 14.2}, {"hose-compliance", 1.1}};
  e.traces = {cycles("baseline.run.h5", 1.2, 8, 3.1), cycles("sweep.run.h5", 2.0, 4, 1.6)};
  e.seconds = 12.4;
  return e;
}

Explanation explained_inclusion() {
  Explanation e;
  e.study = "gel <2>.study.toml";
  e.verdict = Verdict::named;
  e.summary = "A stiff lump of 12 mm sits in the wall near 60 degrees.";
  e.effects = {
      {"stiff-inclusion", {{"theta_deg", 60.4, 0.8, {59.1, 61.7}}, {"contrast", 3.1, 0.2, {2.8, 3.5}}}, {}}};
  e.where = {{"field", "", "tags", {}, {}, {}, "around 60 deg, z 10 mm, inner third", 812.0, 1e-30}};
  e.gap = {1.31, 1.01, 1.0, 0.97, {"frame 4"}};
  e.evidence = {{{"stiff-inclusion"}, 812.0, true, 5, 160.0, "named"},
                {{"fibre-anisotropy"}, 95.0, true, 3, 2.0, "refuted: leaves the place"}};
  e.shifts = {{"C1_kPa", 8.97, 0.08, 8.70, 0.08}};
  e.steps = {{"", 1.31}, {"stiff-inclusion", 1.01}};
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int k = 0; k < 9000; ++k) {
    const double theta = 2 * pi * ((k * 0.6180339887) - std::floor(k * 0.6180339887));
    const double radius = 22.5 + 27.5 * ((k * 0.7548776662) - std::floor(k * 0.7548776662));
    const double z = 85.0 * ((k * 0.5698402910) - std::floor(k * 0.5698402910)) - 42.5;
    const double turn = std::remainder(theta - pi / 3, 2 * pi);
    const double inclusion =
        4.0 * std::exp(-turn * turn / 0.12 - (z - 10) * (z - 10) / 200 - (radius - 28) / 15);
    const double after = noise(random);
    explain::FieldResidual seen{
        {radius * std::cos(theta), radius * std::sin(theta), z}, 1 + k % 5, after + inclusion, after, {}};
    seen.per_mm[static_cast<size_t>(k % 3)] = 1.2;
    e.field.push_back(seen);
  }
  return e;
}

}  // namespace diastole::test
