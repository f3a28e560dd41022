#include "estimator/explain/verdict/experiment_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

namespace diastole::explain {
namespace {

using runfile::Segment;

constexpr double spare = 0.9;
constexpr double seconds_a_segment = 15.0;
constexpr int64_t imaged_cycles = 512;  // 256 lines, every second cycle

/// Peak flow in S/T and peak acceleration in S/T^2 (docs/firmware.md).
struct Waveform {
  std::string_view name;
  double flow, acceleration;
};
constexpr std::array<Waveform, 4> waveforms{
    {{"parabolic", 4.0, 16.0},
     {"sinusoidal", std::numbers::pi, 2 * std::numbers::pi* std::numbers::pi},
     {"sawtooth", 4.76, 119.05},
     {"reversed-sawtooth", 4.76, 119.05}}};

Segment cycling(const char* waveform, double stroke_mL, double period_s, double offset_mL) {
  const auto cycles = std::max<int64_t>(6, std::llround(seconds_a_segment / period_s));
  return {0.0, waveform, stroke_mL, period_s, offset_mL, cycles};
}

double round_to_half(double volume_mL) { return std::floor(2 * volume_mL) / 2; }

}  // namespace

bool ExperimentLimits::allow(const Segment& segment) const {
  if (segment.offset_mL + segment.stroke_mL > largest_mL + 1e-9) return false;
  const auto* shape = std::ranges::find(waveforms, segment.waveform, &Waveform::name);
  if (shape == waveforms.end()) return segment.waveform == "hold";
  const double acceleration = shape->acceleration * segment.stroke_mL / (segment.period_s * segment.period_s);
  return shape->flow * segment.stroke_mL / segment.period_s < spare * flow_mL_s &&
         acceleration < spare * acceleration_mL_s2 && inertance * acceleration < spare * pressure_kPa;
}

std::vector<Segment> possible_segments(const ExperimentLimits& limits) {
  const double whole = round_to_half(limits.largest_mL), half = round_to_half(0.5 * limits.largest_mL),
               quarter = round_to_half(0.25 * limits.largest_mL);
  std::vector<Segment> wanted;
  for (const double stroke_mL : {whole, half}) {
    for (const double period_s : {0.8, 1.2, 2.4})
      wanted.push_back(cycling("parabolic", stroke_mL, period_s, 0.0));
    for (const double period_s : {1.25, 4.0})
      wanted.push_back(cycling("sinusoidal", stroke_mL, period_s, 0.0));
  }
  wanted.push_back(cycling("sinusoidal", quarter, 0.8, 0.0));
  wanted.push_back(cycling("sinusoidal", quarter, 1.25, half));
  wanted.push_back(cycling("parabolic", half, 1.2, half));
  for (const char* waveform : {"sawtooth", "reversed-sawtooth"})
    wanted.push_back(cycling(waveform, half, 2.0, 0.0));
  wanted.push_back({0.0, "hold", whole, 20.0, 0.0, 1});
  wanted.push_back({0.0, "hold", half, 20.0, 0.0, 1});
  std::erase_if(wanted,
                [&](const Segment& segment) { return !limits.allow(segment) || segment.stroke_mL <= 0.0; });
  return wanted;
}

std::string words_of(const Segment& segment) {
  if (segment.waveform == "hold")
    return fmt::format("a hold at {:g} mL for {:g} s", segment.offset_mL + segment.stroke_mL,
                       segment.period_s);
  return fmt::format(
      "{} strokes of {:g} mL in {:g} s{}", segment.waveform, segment.stroke_mL, segment.period_s,
      segment.offset_mL > 0.0 ? fmt::format(" from a preload of {:g} mL", segment.offset_mL) : "");
}

std::string to_toml(const PlannedExperiment& experiment, const std::string& remark) {
  std::string text = fmt::format("# {}\n", remark);
  if (experiment.new_pump_sensor) text += ask_for_pump_sensor;
  if (experiment.volumes) text += ask_for_volumes;
  if (experiment.radius) text += ask_for_radius;
  if (experiment.stiffness) text += ask_for_stiffness;
  text += fmt::format(
      "format = \"diastole-experiment\"\nversion = 1\nsample_rate_Hz = 300\ngate_every = {}\nrest_s = {}\n",
      experiment.volumes ? 2 : 1, "3.0");
  for (const Segment& segment : experiment.segments) {
    const bool imaged = experiment.volumes && segment.waveform != "hold";
    text += fmt::format(
        "\n[[segment]]\nwaveform = \"{}\"\nstroke_mL = {:g}\nperiod_s = {:g}\ncycles = {}\noffset_mL = "
        "{:g}\n",
        segment.waveform, segment.stroke_mL, segment.period_s,
        imaged ? std::max(segment.cycles, imaged_cycles) : segment.cycles, segment.offset_mL);
  }
  return text;
}

}  // namespace diastole::explain
