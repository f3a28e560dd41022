#include "estimator/explain/rig/trial_run.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::explain {
namespace {

constexpr int64_t trial_cycles = 3;
constexpr double rest_s = 1.0, ramp_s = 1.5, rate_Hz = 300.0;
constexpr int64_t most_repeats = 30;  // what is the same in all cycles is not averaged away for ever

}  // namespace

ExperimentLimits limits_of(const rig::Session& session) {
  ExperimentLimits limits{.flow_mL_s = session.limits.flow_mL_s,
                          .acceleration_mL_s2 = session.limits.acceleration_mL_s2,
                          .pressure_kPa = session.limits.pressure_kPa,
                          .inertance = session.base.hose.inertance()};
  double largest_mL = 0.0;
  for (const rig::SessionRun& run : session.runs) {
    for (const rig::Stroke& stroke : run.drive.motion.strokes())
      largest_mL = std::max({largest_mL, stroke.from_mL, stroke.to_mL});
  }
  if (largest_mL > 0.0) limits.largest_mL = largest_mL;
  return limits;
}

TrialRun trial_of(const runfile::Segment& segment, const rig::Session& session) {
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
    runfile::Segment few = segment;
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
