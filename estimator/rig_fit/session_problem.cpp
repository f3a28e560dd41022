#include "estimator/rig_fit/session_problem.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/parallel/parallel_for.hpp"
#include "estimator/rig/sampled_signal.hpp"

namespace diastole::rig {
namespace {

constexpr double modulus_sd = 0.7;  ///< of its logarithm: gels of one recipe and tissues alike
constexpr double offset_sd_Pa = 300.0;
/// Steps of the plant where the pump's pressure is recorded and where it is not. Features are means: with these and three components
/// what is shown errs by less than a twentieth of the model's stated error.
constexpr double pump_step_s = 1.0 / 150.0, cavity_step_s = 1.0 / 100.0;
/// Where something at the pump gives way or the motion has corners they are this many times shorter, and err by less than a fifth.
constexpr double abrupt_steps = 2.0;

/// What is shown by a model with little of such a thing and by one with none differs by the longer steps' error, too.
bool is_abrupt(const RigModel& model) {
  return model.has_corners || model.pump_gas_mL != 0.0 || model.pump_leak_mL_s_kPa != 0.0 ||
         !model.pump_leaks.empty();
}

constexpr size_t modulus_at = 0, cavity_offset_at = 1, pump_offset_at = 2;

/// Bounds that leave less than gels and tissues do state what is known: a normal with mean and sd of what is uniform between them.
Nuisance modulus_of(const SpecimenFamily& family) {
  const StudyParameter& modulus = family.modulus();
  const double sd_of_bounds = std::log(modulus.upper / modulus.lower) / std::sqrt(12.0);
  if (sd_of_bounds < modulus_sd)
    return {"modulus", "ln", sd_of_bounds, 0.5 * std::log(modulus.upper * modulus.lower), false, nullptr};
  return {"modulus", "ln", modulus_sd, std::log(family.modulus_start_kPa()), false, nullptr};
}

}  // namespace

SessionProblem::SessionProblem(const Session& session, const SpecimenFamily& family, size_t threads,
                               std::span<const std::string_view> learnt)
    : session_(session),
      family_(family),
      threads_(threads),
      noise_(estimate_noise(session)),
      features_(session, noise_, threads),
      error_(model_error_of(features_)),
      measured_(features_.measured()),
      nuisances_{modulus_of(family),
                 {"cavity_offset", "Pa", offset_sd_Pa, 0.0, true, nullptr},
                 {"pump_offset", "Pa", offset_sd_Pa, 0.0, true, nullptr}} {
  for (const Tolerance& tolerance : all_tolerances()) {
    const auto stated = session.tolerance_sd.find(std::string(tolerance.name));
    const bool is_stated = stated != session.tolerance_sd.end();
    const double sd = is_stated ? stated->second : tolerance.sd;
    if (tolerance.is_unknown != IsUnknown::always && !is_stated &&
        std::ranges::count(learnt, tolerance.name) == 0)
      continue;
    if (!tolerance.needs_neighbours || family.has_neighbours())
      nuisances_.push_back({std::string(tolerance.name), std::string(tolerance.unit), sd, 0.0,
                            tolerance.sensors_only, &tolerance, is_stated});
  }
  const auto tolerances = static_cast<Eigen::Index>(nuisances_.size() - basic_nuisances);
  prior_ = {Eigen::VectorXd::Zero(tolerances), Eigen::MatrixXd::Identity(tolerances, tolerances),
            Eigen::VectorXd::Ones(tolerances)};
  const double step_s = noise_.channels.contains(Channel::pump) ? pump_step_s : cavity_step_s;
  for (const SessionRun& run : session.runs) {
    smooth_motions_.push_back(sampled_motion(run.drive, dividing_step(run.drive, step_s)));
    abrupt_motions_.push_back(sampled_motion(run.drive, dividing_step(run.drive, step_s / abrupt_steps)));
  }
}

TolerancePrior SessionProblem::finer_prior(double times) const {
  TolerancePrior finer = prior_;
  for (size_t i = basic_nuisances; i < nuisances_.size(); ++i)
    if (!nuisances_[i].is_stated && !nuisances_[i].is_guess())
      finer.described[static_cast<Eigen::Index>(i - basic_nuisances)] /= times;
  finer.root = finer.described.asDiagonal();
  return finer;
}

RigModel SessionProblem::model(const SessionModel& of) const { return model(of, tolerances(of)); }

RigModel SessionProblem::model(const SessionModel& of, const Eigen::VectorXd& offsets) const {
  RigModel model = session_.base;
  model.curve = family_.plain();
  const auto value = [&](size_t i) {
    const double u = i < basic_nuisances ? of.nuisances[static_cast<Eigen::Index>(i)]
                                         : offsets[static_cast<Eigen::Index>(i - basic_nuisances)];
    return nuisances_[i].mean + nuisances_[i].sd * u;
  };
  model.modulus_kPa = std::exp(value(modulus_at));
  model.cavity_offset_kPa = 1e-3 * value(cavity_offset_at);
  model.pump_offset_kPa = 1e-3 * value(pump_offset_at);
  for (size_t i = 0; i < nuisances_.size(); ++i)
    if (nuisances_[i].tolerance != nullptr)
      nuisances_[i].tolerance->apply(value(i), {family_, {}, true}, model);
  std::span<const double> values = of.values;
  for (const ModelTerm& term : of.terms) {
    const size_t count = term.effect->parameters().size();
    term.effect->apply(values.first(count), {family_, term.change_points, true}, model);
    values = values.subspan(count);
  }
  return model;
}

PlantTrace SessionProblem::plant(const RigModel& model, size_t run) const {
  const DriveTrace& motion = (is_abrupt(model) ? abrupt_motions_ : smooth_motions_)[run];
  return simulate_plant(model, session_.runs[run].drive, motion, {.step_s = motion.step_s, .components = 3});
}

RunPrediction SessionProblem::predict_run(size_t run, const RigModel& model, const PlantTrace& plant) const {
  const SessionRun& recorded = session_.runs[run];
  RunPrediction shown{observe(model, plant, recorded.drive.place, recorded.sample_s), {}};
  for (const GatedVolume& volume : recorded.volumes) {
    shown.volumes.emplace_back();
    for (const double phase : volume.measured.phase_s) {
      double sum = 0.0;
      for (const double trigger : volume.trigger_s)
        sum += sampled(plant.cavity_mL, (trigger + phase - plant.start_s) / plant.step_s);
      shown.volumes.back().push_back(model.volume_gain * sum / static_cast<double>(volume.trigger_s.size()));
    }
  }
  return shown;
}

RunPrediction SessionProblem::predict_run(size_t run, const SessionModel& of) const {
  const RigModel made = model(of);
  return predict_run(run, made, plant(made, run));
}

Eigen::MatrixXd SessionProblem::predicted_features(std::span<const SessionModel> models,
                                                   const std::vector<bool>& same_plant) const {
  std::vector<RigModel> made;
  for (const SessionModel& of : models)
    made.push_back(model(of));
  return predicted_features(made, same_plant);
}

Eigen::MatrixXd SessionProblem::predicted_features(std::span<const RigModel> made,
                                                   const std::vector<bool>& same_plant) const {
  const size_t runs = session_.runs.size();
  std::vector<PlantTrace> first(same_plant.empty() ? 0 : runs);
  parallel_for(first.size(), threads_, [&](size_t r) { first[r] = plant(made.front(), r); });
  Eigen::MatrixXd out(features_.count(), static_cast<Eigen::Index>(made.size()));
  constexpr size_t together = 4;  // models of one run: a feature's function is read once for them
  parallel_for((made.size() + together - 1) / together * runs, threads_, [&](size_t task) {
    const size_t r = task % runs;
    const size_t from = task / runs * together;
    std::vector<RunPrediction> seen;
    for (size_t m = from; m < std::min(from + together, made.size()); ++m) {
      const bool kept = !same_plant.empty() && (m == 0 || same_plant[m]);
      seen.push_back(kept ? predict_run(r, made[m], first[r]) : predict_run(r, made[m], plant(made[m], r)));
    }
    features_.project(
        r, seen, out.middleCols(static_cast<Eigen::Index>(from), static_cast<Eigen::Index>(seen.size())));
  });
  return out;
}

Eigen::VectorXd SessionProblem::nuisance_steps(const SessionModel& at, double part) const {
  Eigen::VectorXd steps = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(nuisances_.size()), part);
  steps.tail(prior(at).root.rows()) = part * prior(at).root.rowwise().norm();
  return steps;
}

std::vector<RigModel> SessionProblem::stepped(const SessionModel& at, const Eigen::VectorXd& steps) const {
  constexpr auto basic = static_cast<Eigen::Index>(basic_nuisances);
  const Eigen::VectorXd from = tolerances(at);
  std::vector<RigModel> models;
  for (Eigen::Index i = 0; i < steps.size(); ++i) {
    SessionModel moved = at;
    Eigen::VectorXd offsets = from;
    (i < basic ? moved.nuisances[i] : offsets[i - basic]) += steps[i];
    models.push_back(model(moved, offsets));
  }
  return models;
}

Eigen::MatrixXd SessionProblem::by_u(const SessionModel& at, Eigen::MatrixXd by_steps) const {
  const Eigen::MatrixXd& root = prior(at).root;
  by_steps.rightCols(root.cols()) *= root;
  return by_steps;
}

// Tolerances are moved one by one, of which u may be combinations: some change nothing but what the sensors show.

Eigen::MatrixXd SessionProblem::differences(const SessionModel& at, double part, bool both_sides,
                                            Eigen::VectorXd& there) const {
  const Eigen::VectorXd steps = nuisance_steps(at, part);
  std::vector<RigModel> models{model(at)};
  std::vector<bool> same_plant{true};
  const auto add = [&](const Eigen::VectorXd& by) {
    for (RigModel& moved : stepped(at, by))
      models.push_back(std::move(moved));
    for (const Nuisance& nuisance : nuisances_)
      same_plant.push_back(nuisance.sensors_only);
  };
  add(steps);
  if (both_sides) add(-steps);
  const Eigen::MatrixXd all = predicted_features(models, same_plant);
  there = all.col(0);
  const Eigen::MatrixXd after = all.middleCols(1, steps.size());
  if (both_sides)
    return by_u(at, (after - all.rightCols(steps.size())) * (2.0 * steps).cwiseInverse().asDiagonal());
  return by_u(at, (after.colwise() - there) * steps.cwiseInverse().asDiagonal());
}

Eigen::MatrixXd SessionProblem::nuisance_columns(const SessionModel& at, Eigen::VectorXd& there) const {
  return differences(at, 0.5, false, there);
}

Eigen::MatrixXd SessionProblem::nuisance_slopes(const SessionModel& at, Eigen::VectorXd& there,
                                                bool both_sides) const {
  return differences(at, 0.005, both_sides, there);
}

}  // namespace diastole::rig
