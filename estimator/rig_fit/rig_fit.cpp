#include "estimator/rig_fit/rig_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "estimator/parallel/parallel_for.hpp"
#include "estimator/rig/sampled_signal.hpp"

namespace diastole::rig {
namespace {

constexpr double offset_reach_Pa = 2000.0;

/// Mean over the cycles of what the plant's volume was at each phase.
std::vector<double> gated(const GatedVolume& volume, const PlantTrace& plant) {
  std::vector<double> mean;
  for (const double phase : volume.measured.phase_s) {
    double sum = 0.0;
    for (const double trigger : volume.trigger_s)
      sum += sampled(plant.cavity_mL, (trigger + phase - plant.start_s) / plant.step_s);
    mean.push_back(sum / static_cast<double>(volume.trigger_s.size()));
  }
  return mean;
}

/// Means over a tenth of a second: what is slower than the line's resonances, in which a fit from afar would be lost.
std::vector<double> smoothed(const ChannelNoise& noise, const std::vector<double>& values) {
  constexpr size_t window = 30;
  std::vector<double> means(values.size(), 0.0);
  double sum = 0.0;
  for (size_t k = 0; k < values.size(); ++k) {
    sum += std::isfinite(values[k]) ? values[k] : 0.0;
    if (k >= window) sum -= std::isfinite(values[k - window]) ? values[k - window] : 0.0;
    if (k + 1 >= window) means[k] = sum / static_cast<double>(window) / noise.sd_kPa;
  }
  return means;
}

bool is_missing(double value) { return !std::isfinite(value); }

/// Where there is no sensor at the pump, steps may be this many times longer: the cavity errs by less than 0.1 Pa.
constexpr double cavity_steps = 2.0;
/// And for columns and coarse looks, whose errors cancel or do not matter.
constexpr double column_steps = 2.0;

}  // namespace

Unknown unknown_of(const Effect& effect, const EffectParameter& parameter) {
  constexpr double small = 1e-3;  // of a typical size: far above rounding, far below curvature
  Unknown unknown{{.name = fmt::format("{}.{}", effect.text().id, parameter.name),
                   .unit = std::string(parameter.unit),
                   .lower = parameter.lower,
                   .upper = parameter.upper,
                   .scale = parameter.scale}};
  const auto [lower, upper] = unknown.coordinate_bounds();
  const double size = std::abs(unknown.coordinate(parameter.typical) - unknown.coordinate(parameter.neutral));
  unknown.perturbation = small * (size == 0.0 ? 0.1 * (upper - lower) : size);
  unknown.sensors_only = effect.stage() == Stage::sensors;
  return unknown;
}

double sized_value(const EffectParameter& parameter, double neutral, double size) {
  const double from = inference::to_coordinate(parameter.scale, neutral);
  const double towards = inference::to_coordinate(parameter.scale, parameter.typical);
  return inference::from_coordinate(parameter.scale, from + size * (towards - from));
}

double RigFit::value(std::string_view name) const {
  for (size_t i = 0; i < unknowns.size(); ++i)
    if (unknowns[i].name == name) return values[i];
  return std::numeric_limits<double>::quiet_NaN();
}

RigProblem::RigProblem(const Session& session, const SpecimenFamily& family, const RigFitOptions& options)
    : session_(session),
      family_(family),
      options_(options),
      noise_(options.noise ? *options.noise : estimate_noise(session)) {
  set_blocks();
  for (const SessionRun& run : session.runs) {
    motions_.push_back(sampled_motion(run.drive, step_s(Fidelity::fine)));
    coarse_motions_.push_back(sampled_motion(run.drive, step_s(Fidelity::coarse)));
  }
  KnownModel varying = options.variation_of.value_or(KnownModel{{}, {family.modulus_start_kPa(), 0.0, 0.0}});
  if (!options.variation_of) varying = fit_from(varying);
  set_cycle_variations(varying);
  base_ = fit_from({{}, {varying.values.begin(), varying.values.begin() + nuisances}});
}

void RigProblem::set_blocks() {
  for (size_t r = 0; r < session_.runs.size(); ++r) {
    const SessionRun& run = session_.runs[r];
    for (const auto& [channel, noise] : noise_.channels) {
      const auto& values = run.pressure_kPa.at(channel);
      blocks_.push_back({r, std::string(name_of(channel)), rows_, values.size()});
      rows_ += values.size();
      const auto missing = static_cast<size_t>(std::count_if(values.begin(), values.end(), is_missing));
      present_.push_back(values.size() - std::min(values.size(), missing + noise.autoregression.size()));
    }
    size_t gated_rows = 0;
    for (const GatedVolume& volume : run.volumes)
      gated_rows += volume.measured.phase_s.size();
    if (gated_rows == 0) continue;
    blocks_.push_back({r, "cavity_mL", rows_, gated_rows});
    present_.push_back(gated_rows);
    rows_ += gated_rows;
  }
}

std::vector<Unknown> RigProblem::unknowns(const std::vector<ModelTerm>& terms) const {
  const double softest_kPa = 0.2 * family_.modulus().lower;
  const auto offset = [](const char* name) {
    return Unknown{
        {.name = name, .unit = "Pa", .lower = -offset_reach_Pa, .upper = offset_reach_Pa}, 1.0, true};
  };
  std::vector<Unknown> list{
      {{.name = "modulus_kPa", .unit = "kPa", .lower = softest_kPa, .upper = 5.0 * family_.modulus().upper},
       std::max(1e-3 * softest_kPa, 1e-3)},
      offset("cavity_offset_Pa"),
      offset("pump_offset_Pa")};
  for (const ModelTerm& term : terms)
    for (const EffectParameter& parameter : term.effect->parameters())
      list.push_back(unknown_of(*term.effect, parameter));
  return list;
}

RigModel RigProblem::model(const KnownModel& of, bool low_fidelity) const {
  RigModel model = session_.base;
  model.curve = family_.plain();
  model.modulus_kPa = of.values[0];
  model.cavity_offset_kPa = 1e-3 * of.values[1];
  model.pump_offset_kPa = 1e-3 * of.values[2];
  std::span<const double> values = std::span(of.values).subspan(nuisances);
  for (const ModelTerm& term : of.terms) {
    const size_t count = term.effect->parameters().size();
    term.effect->apply(values.first(count), {family_, term.change_points, low_fidelity}, model);
    values = values.subspan(count);
  }
  return model;
}

double RigProblem::step_s(Fidelity fidelity) const {
  const double fine =
      options_.simulation.step_s * (noise_.channels.contains(Channel::pump) ? 1.0 : cavity_steps);
  return fidelity == Fidelity::fine ? fine : column_steps * fine;
}

std::vector<size_t> RigProblem::chosen_runs(const FitRequest& request) const {
  std::vector<size_t> chosen;
  for (size_t r = 0; r < session_.runs.size(); ++r)
    if (request.runs.empty() || request.runs[r]) chosen.push_back(r);
  return chosen;
}

size_t RigProblem::count_rows(const FitRequest& request) const {
  size_t count = 0;
  for (size_t b = 0; b < blocks_.size(); ++b)
    if (request.runs.empty() || request.runs[blocks_[b].run]) count += present_[b];
  return count;
}

PlantTrace RigProblem::plant(const RigModel& model, size_t run, Fidelity steps) const {
  SimulationOptions simulation = options_.simulation;
  simulation.step_s = step_s(steps);
  const DriveTrace& motion = (steps == Fidelity::fine ? motions_ : coarse_motions_)[run];
  return simulate_plant(model, session_.runs[run].drive, motion, simulation);
}

void RigProblem::compare_channel(const ResidualBlock& block, Channel channel,
                                 const std::vector<double>& predicted, Fidelity fidelity,
                                 Eigen::Ref<Eigen::VectorXd> out) const {
  const auto& measured = session_.runs[block.run].pressure_kPa.at(channel);
  std::vector<double> difference(measured.size());
  for (size_t k = 0; k < measured.size(); ++k)
    difference[k] = measured[k] - predicted[k];
  const ChannelNoise& noise = noise_.channels.at(channel);
  const std::vector<double> white =
      fidelity == Fidelity::fine ? whitened(noise, difference) : smoothed(noise, difference);
  for (size_t k = 0; k < white.size(); ++k)
    out[static_cast<Eigen::Index>(block.first + k)] = white[k];
}

void RigProblem::compare(const RigModel& model, const PlantTrace& plant, size_t run, Fidelity fidelity,
                         Eigen::Ref<Eigen::VectorXd> out) const {
  const SessionRun& recorded = session_.runs[run];
  const Prediction shown = observe(model, plant, recorded.drive.place, recorded.sample_s);
  for (const ResidualBlock& block : blocks_) {
    if (block.run != run) continue;
    if (block.channel == name_of(Channel::cavity)) {
      compare_channel(block, Channel::cavity, shown.cavity_kPa, fidelity, out);
    } else if (block.channel == name_of(Channel::pump)) {
      compare_channel(block, Channel::pump, shown.pump_kPa, fidelity, out);
    } else {
      auto row = static_cast<Eigen::Index>(block.first);
      for (const GatedVolume& volume : recorded.volumes) {
        const std::vector<double> mean = gated(volume, plant);
        for (size_t f = 0; f < mean.size(); ++f)
          out[row++] = (volume.measured.cavity_mL[f] - mean[f]) / volume.measured.sigma_mL[f];
      }
    }
  }
  if (fidelity == Fidelity::fine) shrink_cycle_variations(run, out);
}

Eigen::VectorXd RigProblem::residuals(const KnownModel& of, const FitRequest& request) const {
  const RigModel made = model(of, request.difference);
  const std::vector<size_t> runs = chosen_runs(request);
  Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows_));
  parallel_for(runs.size(), options_.threads, [&](size_t i) {
    const Fidelity steps = request.difference ? Fidelity::coarse : request.fidelity;
    compare(made, plant(made, runs[i], steps), runs[i], request.fidelity, out);
  });
  return out;
}

Eigen::MatrixXd RigProblem::columns(const KnownModel& at, const FitRequest& request) const {
  const std::vector<Unknown> list = unknowns(at.terms);
  const RigModel here = model(at);
  std::vector<RigModel> moved;
  std::vector<double> steps;
  for (size_t i = 0; i < list.size(); ++i) {
    const auto [lower, upper] = list[i].coordinate_bounds();
    const double coordinate = std::clamp(list[i].coordinate(at.values[i]), lower, upper);
    steps.push_back(list[i].step_from(coordinate));
    KnownModel other = at;
    other.values[i] = list[i].value(coordinate + steps.back());
    moved.push_back(model(other));
  }
  const std::vector<size_t> runs = chosen_runs(request);
  const auto rows = static_cast<Eigen::Index>(rows_);
  Eigen::VectorXd there = Eigen::VectorXd::Zero(rows);
  std::vector<PlantTrace> plants(runs.size());
  parallel_for(runs.size(), options_.threads, [&](size_t i) {
    plants[i] = plant(here, runs[i], Fidelity::coarse);
    compare(here, plants[i], runs[i], request.fidelity, there);
  });
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(moved.size()));
  parallel_for(moved.size() * runs.size(), options_.threads, [&](size_t task) {
    const size_t i = task % runs.size();
    const size_t j = task / runs.size();
    auto column = out.col(static_cast<Eigen::Index>(j));
    const bool same_plant = list[j].sensors_only;
    compare(moved[j], same_plant ? plants[i] : plant(moved[j], runs[i], Fidelity::coarse), runs[i],
            request.fidelity, column);
  });
  for (size_t j = 0; j < moved.size(); ++j) {
    auto column = out.col(static_cast<Eigen::Index>(j));
    column = (column - there) / steps[j];
  }
  return out;
}

std::vector<Prediction> RigProblem::predictions(const KnownModel& of) const {
  const RigModel made = model(of);
  std::vector<Prediction> seen(session_.runs.size());
  parallel_for(seen.size(), options_.threads, [&](size_t r) {
    const SessionRun& run = session_.runs[r];
    seen[r] = observe(made, plant(made, r, Fidelity::fine), run.drive.place, run.sample_s);
  });
  return seen;
}

}  // namespace diastole::rig
