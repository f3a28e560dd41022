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
constexpr int64_t trial_cycles = 3;
constexpr double rest_s = 1.0, ramp_s = 1.5, rate_Hz = 300.0;
constexpr int64_t imaged_cycles = 512;  // 256 lines, every second cycle
constexpr int64_t most_repeats = 30;    // what is the same in all cycles is not averaged away for ever

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

ExperimentLimits ExperimentLimits::of(const rig::Session& session) {
  ExperimentLimits limits;
  limits.motion = session.limits;
  double largest_mL = 0.0;
  for (const rig::SessionRun& run : session.runs) {
    for (const rig::Stroke& stroke : run.drive.motion.strokes())
      largest_mL = std::max({largest_mL, stroke.from_mL, stroke.to_mL});
  }
  if (largest_mL > 0.0) limits.largest_mL = largest_mL;
  return limits;
}

bool ExperimentLimits::allow(const Segment& segment, const rig::Hose& hose) const {
  if (segment.offset_mL + segment.stroke_mL > largest_mL + 1e-9) return false;
  const auto* shape = std::ranges::find(waveforms, segment.waveform, &Waveform::name);
  if (shape == waveforms.end()) return segment.waveform == "hold";
  const double acceleration = shape->acceleration * segment.stroke_mL / (segment.period_s * segment.period_s);
  return shape->flow * segment.stroke_mL / segment.period_s < spare * motion.flow_mL_s &&
         acceleration < spare * motion.acceleration_mL_s2 &&
         hose.inertance() * acceleration < spare * motion.pressure_kPa;
}

std::vector<Segment> possible_segments(const ExperimentLimits& limits, const rig::Hose& hose) {
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
  std::erase_if(wanted, [&](const Segment& segment) {
    return !limits.allow(segment, hose) || segment.stroke_mL <= 0.0;
  });
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
  if (experiment.new_pump_sensor) {
    text +=
        "# Connect a pressure transducer at the pump end of the hose and name its input in the rig file:\n"
        "# [[daq.channel]] name = \"pump\".\n";
  }
  if (experiment.volumes) {
    text += "# Image the cavity with gated phase contrast meanwhile: 256 lines, one every second cycle.\n";
  }
  if (experiment.radius) {
    text +=
        "# Image the specimen at rest and give its inner radius to the study: specimen.inner_radius_mm.\n";
  }
  if (experiment.stiffness) {
    text +=
        "# Measure C1 by a rotational shear test and bound it in the study: law.parameters.C1_kPa.bounds.\n";
  }
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

TrialRun trial_of(const Segment& segment, const rig::Session& session) {
  TrialRun trial;
  std::vector<rig::Stroke> strokes;
  double now_s = rest_s;
  const auto ramp = [&](double from_mL, double to_mL) {
    if (from_mL == to_mL) return;
    strokes.push_back({now_s, now_s + ramp_s, from_mL, to_mL});
    now_s += ramp_s;
  };
  double least_mL = segment.offset_mL;
  if (segment.waveform == "hold") {
    least_mL += segment.stroke_mL;
    ramp(0.0, least_mL);
    now_s += segment.period_s * static_cast<double>(segment.cycles);
  } else {
    ramp(0.0, least_mL);
    Segment few = segment;
    few.start_s = now_s;
    few.cycles = std::min(segment.cycles, trial_cycles);
    const std::vector<rig::Stroke> cycles = rig::strokes_of(few);
    strokes.insert(strokes.end(), cycles.begin(), cycles.end());
    for (int64_t cycle = 0; cycle < few.cycles; ++cycle)
      trial.drive.place.trigger_s.push_back(now_s + segment.period_s * static_cast<double>(cycle));
    now_s = few.end_s();
    trial.last_first = static_cast<size_t>(std::lround((now_s - segment.period_s) * rate_Hz));
    trial.last_end = static_cast<size_t>(std::lround(now_s * rate_Hz));
    trial.repeats = static_cast<double>(std::min(segment.cycles, most_repeats) - few.cycles + 1);
  }
  ramp(least_mL, 0.0);
  constexpr double settle_s = 0.5;
  trial.drive.motion = rig::Motion(strokes, 0.0, session.runs.front().drive.motion.spread_s());
  trial.drive.end_s = now_s + settle_s;
  const auto samples = static_cast<size_t>(trial.drive.end_s * rate_Hz);
  for (size_t k = 0; k < samples; ++k)
    trial.sample_s.push_back(static_cast<double>(k) / rate_Hz);

  rig::RunPlace& place = trial.drive.place;
  place.name = "next";
  constexpr double pause_s = 60.0;
  for (const rig::SessionRun& run : session.runs) {
    const double length_s = run.drive.end_s - run.drive.start_s;
    place.started_s = std::max(place.started_s, run.drive.place.started_s + length_s + pause_s);
    place.cycles_before += static_cast<double>(run.drive.place.trigger_s.size());
    for (const rig::Stroke& stroke : run.drive.motion.strokes())
      place.largest_before_mL = std::max(place.largest_before_mL, stroke.to_mL);
    place.atmosphere_kPa = run.drive.place.atmosphere_kPa;
  }
  return trial;
}

}  // namespace diastole::explain
