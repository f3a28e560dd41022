#pragma once
// A short session without files: three runs of motion, and recordings made by the model itself with noise.

#include <cmath>
#include <random>

#include "estimator/model/specimen_family.hpp"
#include "estimator/rig_fit/model_term.hpp"
#include "estimator/rig_fit/noise_model.hpp"

namespace diastole::rig {

inline Study gel_study() {
  Study study;
  study.specimen = AnnulusSpecimen{22.5, 50.0, 85.0, {4, 2, 1}, "fixed"};
  study.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
  return study;
}

/// Coarse, for tests that compare the family with itself.
inline SpecimenFamily gel_family() {
  return SpecimenFamily(gel_study(), {{4, 2, 1}, {4, 2, 1}, 16.0, 3, 1, 1});
}

inline SessionRun empty_run(const std::string& name, const runfile::Segment& segment, double started_s) {
  constexpr double rest_s = 1.2;
  SessionRun run;
  std::vector<Stroke> strokes;
  const bool cosine = segment.waveform == "sinusoidal";
  for (int64_t cycle = 0; cycle < segment.cycles; ++cycle) {
    const double start_s = rest_s + static_cast<double>(cycle) * segment.period_s;
    const double half_s = segment.waveform == "hold" ? 0.6 : 0.5 * segment.period_s;
    const double back_s = segment.waveform == "hold" ? 0.8 * segment.period_s : half_s;
    strokes.push_back({start_s, start_s + half_s, 0.0, segment.stroke_mL, 0.5, cosine});
    strokes.push_back({start_s + back_s, start_s + back_s + half_s, segment.stroke_mL, 0.0, 0.5, cosine});
    run.drive.place.trigger_s.push_back(start_s);
  }
  run.drive.motion = Motion(strokes, 0.0, 0.05);
  run.drive.place.name = name;
  run.drive.place.started_s = started_s;
  run.segments = {segment};
  run.segments.front().start_s = rest_s;
  run.drive.end_s = run.segments.front().end_s() + 0.8;
  for (double t = 0.0; t <= run.drive.end_s; t += 1.0 / 300.0)
    run.sample_s.push_back(t);
  return run;
}

struct SessionOptions {
  std::vector<ModelTerm> terms = {};
  std::vector<double> values = {};  ///< of the terms
  double noise_kPa = 0.01;
  double cycle_sd = 0.0;  ///< of each cycle's stroke, relative
  unsigned seed = 1;
};

/// Each cycle's stroke larger or smaller. Precondition: two strokes a cycle, from zero and back.
inline Motion varying(const Motion& motion, double cycle_sd, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  std::vector<Stroke> strokes = motion.strokes();
  for (size_t k = 0; k + 1 < strokes.size(); k += 2) {
    strokes[k].to_mL *= 1.0 + cycle_sd * normal(generator);
    strokes[k + 1].from_mL = strokes[k].to_mL;
  }
  return {std::move(strokes), motion.rest_mL(), motion.spread_s()};
}

inline Session simulated_session(const SpecimenFamily& family, const SessionOptions& options,
                                 const runfile::Segment& baseline = {0.0, "parabolic", 40.0, 1.2, 0.0, 4}) {
  Session session;
  session.runs.push_back(empty_run("baseline", baseline, 0.0));
  session.runs.push_back(empty_run("sweep", {0.0, "sinusoidal", 20.0, 1.6, 0.0, 3}, 60.0));
  session.runs.push_back(empty_run("hold", {0.0, "hold", 30.0, 6.0, 0.0, 1}, 150.0));
  RigModel model = session.base;
  model.curve = family.plain();
  model.modulus_kPa = 8.0;
  size_t at = 0;
  for (const ModelTerm& term : options.terms) {
    const size_t count = term.effect->parameters().size();
    term.effect->apply({options.values.data() + at, count}, {family, term.change_points}, model);
    at += count;
  }
  std::mt19937 generator(options.seed);
  std::normal_distribution<double> normal;
  for (SessionRun& run : session.runs) {
    RunDrive drive = run.drive;
    if (options.cycle_sd > 0.0) drive.motion = varying(drive.motion, options.cycle_sd, generator);
    const PlantTrace plant = simulate_plant(model, drive);
    Prediction seen = observe(model, plant, run.drive.place, run.sample_s);
    for (auto* channel : {&seen.cavity_kPa, &seen.pump_kPa}) {
      const double sd = channel == &seen.cavity_kPa ? options.noise_kPa : 5.0 * options.noise_kPa;
      double correlated = 0.0;
      for (double& value : *channel) {
        correlated = 0.7 * correlated + std::sqrt(1.0 - 0.49) * normal(generator);
        value += sd * correlated;
      }
    }
    run.pressure_kPa[Channel::cavity] = seen.cavity_kPa;
    run.pressure_kPa[Channel::pump] = seen.pump_kPa;
  }
  return session;
}

}  // namespace diastole::rig
