#pragma once
// The simulated rig's plant without controller and daemon: a drive in, the run file's content and the true volume out. What
// /mr/flow of a scanner would hold is the truth with its noise.

#include <cmath>
#include <optional>
#include <random>

#include "estimator/shaping/gated_run.hpp"
#include "protocol/runfile/run.hpp"
#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::shaping {

struct PlantRun {
  runfile::RecordedRun run;
  PeriodicCurve true_mL;  ///< mean over the cycles that count
};

class PlantForShape {
 public:
  PlantForShape(const sim_rig::PlantConfig& config, const CyclePlan& plan)
      : plant_(config), plan_(plan), noise_(config.seed) {}

  /// From `leak_at_s` of this run on the cavity leaks.
  PlantRun play(const PeriodicCurve& drive_mL, std::optional<double> gated_sd_mL = {},
                std::optional<double> leak_at_s = {});

 private:
  static constexpr double microstep_mL = 0.00779;

  sim_rig::Plant plant_;
  CyclePlan plan_;
  std::mt19937_64 noise_;
  double now_s_ = 0.0;
};

inline PlantRun PlantForShape::play(const PeriodicCurve& drive_mL, std::optional<double> gated_sd_mL,
                                    std::optional<double> leak_at_s) {
  constexpr double tick_s = 0.0005, ramp_s = 1.0, sample_s = 1.0 / 300.0, leak_mL_s_kPa = 2.0;
  constexpr size_t points = 256, phases = 32;
  const double period_s = drive_mL.period_s, begins_s = drive_mL.least_at_s(),
               least_mL = drive_mL.at(begins_s);
  const double first_s = plan_.rest_s + ramp_s, cycles = static_cast<double>(plan_.cycles);
  const double last_s = first_s + cycles * period_s, end_s = last_s + ramp_s;
  const auto ramp = [&](double since_s) {
    return 0.5 * least_mL * (1.0 - std::cos(M_PI * since_s / ramp_s));
  };
  const auto commanded = [&](double t) {
    if (t < plan_.rest_s) return 0.0;
    if (t < first_s) return ramp(t - plan_.rest_s);
    if (t < last_s) return drive_mL.at(begins_s + t - first_s);
    return ramp(ramp_s - std::min(t - last_s, ramp_s));
  };
  PlantRun played;
  runfile::RecordedRun& run = played.run;
  run.file = "plant.run.h5";
  std::vector<double> true_mL(4 * points, 0.0), seen(4 * points, 0.0);
  double held_mL = 0.0, next_sample_s = 0.0;
  size_t triggers = 0;
  for (double t = 0.0; t < end_s; t += tick_s) {
    if (leak_at_s && t >= *leak_at_s) plant_.leak(leak_mL_s_kPa);
    if (triggers < plan_.cycles && t >= first_s + period_s * static_cast<double>(triggers)) {
      plant_.begin_cycle();
      run.trigger_s.push_back(t);
      ++triggers;
    }
    const double steps_mL = microstep_mL * std::round(commanded(t) / microstep_mL);
    if (steps_mL != held_mL) plant_.displace(now_s_ + t, held_mL = steps_mL);
    plant_.advance_to(now_s_ + t);
    const double in_cycles = (t - first_s) / period_s;
    if (in_cycles >= static_cast<double>(plan_.settling) && t < last_s) {
      const double on_curve = std::fmod(begins_s + t - first_s, period_s) / period_s;
      const auto bin = static_cast<size_t>(on_curve * static_cast<double>(true_mL.size()));
      true_mL[bin] += plant_.cavity_mL();
      seen[bin] += 1.0;
    }
    if (t < next_sample_s) continue;
    next_sample_s += sample_s;
    run.pump.time_s.push_back(t);
    run.pump.commanded_mL.push_back(held_mL);
    run.pressure.time_s.push_back(t);
    run.pressure.channels["cavity_kPa"].push_back(plant_.cavity_reading_kPa());
  }
  now_s_ += end_s;
  for (size_t j = 0; j < true_mL.size(); ++j)
    true_mL[j] /= seen[j];
  played.true_mL = periodic_curve(true_mL, period_s, 200);
  for (Eigen::Index k = 1; k <= played.true_mL.harmonics(); ++k)  // bins stand for their middles
    played.true_mL.c[k] *=
        std::polar(1.0, -M_PI * static_cast<double>(k) / static_cast<double>(true_mL.size()));
  runfile::PlayedWaveform waveform{.points = lead_line(period_s - begins_s), .phase = {}, .fraction = {}};
  const double stroke_mL = drive_mL.range();
  for (size_t j = 0; j <= points; ++j) {
    const double phase = static_cast<double>(j) / points;
    waveform.phase.push_back(phase);
    waveform.fraction.push_back((drive_mL.at(begins_s + period_s * phase) - least_mL) / stroke_mL);
  }
  run.waveforms[0] = waveform;
  run.segments = {{first_s, "uploaded", stroke_mL, period_s, least_mL, static_cast<int64_t>(plan_.cycles)}};
  if (gated_sd_mL) {
    std::normal_distribution<double> scatter(0.0, *gated_sd_mL);
    runfile::FlowVolume& flow = run.flow[0];
    for (size_t j = 0; j < phases; ++j) {
      const double phase_s = period_s * (static_cast<double>(j) + 0.5) / phases;
      flow.phase_s.push_back(phase_s);
      flow.cavity_mL.push_back(played.true_mL.at(begins_s + phase_s) + scatter(noise_));
      flow.sigma_mL.push_back(*gated_sd_mL);
    }
  }
  return played;
}

}  // namespace diastole::shaping
