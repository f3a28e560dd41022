#include "estimator/explain/rig/next_experiment.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "estimator/inference/information.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::explain {
namespace {

constexpr size_t most_segments = 3;
constexpr double worth_it = 1.08;        // gain by one segment more
constexpr double clear_sigma = 5.0;      // beyond this nobody needs more equipment
constexpr double worthwhile_gain = 1.3;  // gain that is worth connecting something
constexpr size_t most_models = 3;

std::string ids_of(const FittedModel& fit) {
  std::vector<std::string_view> ids;
  for (const rig::ModelTerm& term : fit.model.terms)
    ids.push_back(term.effect->text().id);
  return ids.empty() ? "no effect" : fmt::format("{}", fmt::join(ids, " + "));
}

/// Larger is better. Of the segments chosen, by index.
using Worth = std::function<double(const std::vector<size_t>& chosen, const Equipment& equipment)>;

struct Choice {
  std::vector<size_t> segments;
  double worth = 0.0;
};

/// The best single segment, then whatever adds most to it until that is plenty.
Choice best_of(size_t count, const Equipment& equipment, double enough, const Worth& worth) {
  constexpr double plenty = 3.0;
  Choice best;
  while (best.segments.size() < most_segments && best.worth < plenty * enough) {
    Choice better = best;
    for (size_t i = 0; i < count; ++i) {
      if (std::ranges::count(best.segments, i) > 0) continue;
      std::vector<size_t> chosen = best.segments;
      chosen.push_back(i);
      const double value = worth(chosen, equipment);
      if (value > better.worth) better = {chosen, value};
    }
    if (better.worth <= best.worth * (best.segments.empty() ? 1.0 : worth_it)) break;
    best = better;
  }
  return best;
}

struct Plan {
  PlannedExperiment experiment;
  double worth = 0.0;
};

/// With what the session had, and with more where that is worth it.
Plan plan_of(const rig::Session& session, const std::vector<runfile::Segment>& segments, double enough,
             const Worth& worth) {
  const Equipment present = equipment_of(session);
  const auto plan_with = [&](const Equipment& equipment) {
    const Choice choice = best_of(segments.size(), equipment, enough, worth);
    Plan plan;
    plan.worth = choice.worth;
    for (const size_t i : choice.segments)
      plan.experiment.segments.push_back(segments[i]);
    plan.experiment.new_pump_sensor = equipment[1] && !present[1];
    plan.experiment.volumes = equipment[2];
    plan.experiment.radius = equipment[3];
    plan.experiment.stiffness = equipment[4];
    return plan;
  };
  // Volumes cost ten minutes of imaging a segment: they are an addition even where the session has some.
  const bool pump = present[1];
  Plan best = plan_with({true, pump});
  for (const Equipment& more :
       {Equipment{true, true}, Equipment{true, pump, true}, Equipment{true, pump, false, true},
        Equipment{true, pump, false, false, true}, Equipment{true, pump, true, true},
        Equipment{true, pump, false, true, true}, Equipment{true, pump, true, true, true}}) {
    if (best.worth >= enough) break;
    Plan other = plan_with(more);
    if (other.worth > worthwhile_gain * best.worth) best = std::move(other);
  }
  return best;
}

std::string plan_words(const PlannedExperiment& experiment) {
  std::vector<std::string> parts;
  for (const runfile::Segment& segment : experiment.segments)
    parts.push_back(words_of(segment));
  std::string words = fmt::format("{}", fmt::join(parts, ", then "));
  if (experiment.new_pump_sensor) words += ", with a pressure transducer added at the pump end of the hose";
  if (experiment.volumes) words += ", with gated phase-contrast volumes of the cavity";
  if (experiment.radius) words += ", with the inner radius measured in an image at rest";
  if (experiment.stiffness) words += ", with C1 measured by a shear test";
  if (!words.empty() && words[0] >= 'a' && words[0] <= 'z')
    words[0] = static_cast<char>(words[0] - 'a' + 'A');
  return words;
}

std::vector<SegmentOutlook> outlooks_of(const ExperimentDesign& design,
                                        const std::vector<const FittedModel*>& models,
                                        const std::vector<runfile::Segment>& segments) {
  std::vector<SegmentOutlook> outlooks(segments.size());
  parallel_for(segments.size(), design.threads,
               [&](size_t i) { outlooks[i] = look_ahead(design.problem, models, segments[i]); });
  return outlooks;
}

/// Sum over the chosen segments.
Eigen::MatrixXd gram_of(const std::vector<SegmentOutlook>& outlooks, const std::vector<size_t>& chosen,
                        size_t truth, size_t adapting, const Equipment& equipment) {
  Eigen::MatrixXd sum = outlooks[chosen.front()].of(truth, adapting, equipment);
  for (size_t i = 1; i < chosen.size(); ++i)
    sum += outlooks[chosen[i]].of(truth, adapting, equipment);
  return sum;
}

/// The unknown of an effect that is known least against its distance from neutral.
struct LeastKnown {
  size_t index = 0;
  double distance = 0.0;  ///< from neutral, in the search coordinate
};
LeastKnown least_known(const rig::Session& session, const FittedModel& fit,
                       const Eigen::MatrixXd& covariance) {
  LeastKnown least;
  double worst = -1.0;
  size_t at = fit.model.values.size();
  for (auto term = fit.model.terms.rbegin(); term != fit.model.terms.rend(); ++term) {
    const std::vector<double> neutral = term->effect->neutral(session.base);
    at -= neutral.size();
    for (size_t j = 0; j < neutral.size(); ++j) {
      const rig::Unknown& unknown = fit.unknowns[at + j];
      const double distance =
          std::abs(unknown.coordinate(fit.model.values[at + j]) - unknown.coordinate(neutral[j]));
      const auto row = static_cast<Eigen::Index>(at + j);
      const double unsure = std::sqrt(covariance(row, row)) / std::max(distance, 1e-12);
      if (!std::isfinite(unsure) || unsure <= worst) continue;
      worst = unsure;
      least = {at + j, distance};
    }
  }
  return least;
}

}  // namespace

std::optional<NextExperiment> separating_experiment(const ExperimentDesign& design,
                                                    const std::vector<const FittedModel*>& competing) {
  if (competing.size() < 2) return std::nullopt;
  const std::vector<const FittedModel*> models(
      competing.begin(),
      competing.begin() + static_cast<std::ptrdiff_t>(std::min(competing.size(), most_models)));
  const auto segments = possible_segments(design.limits);
  if (segments.empty()) return std::nullopt;
  const auto outlooks = outlooks_of(design, models, segments);
  std::vector<Eigen::MatrixXd> known;
  for (const FittedModel* model : models)
    known.push_back(known_before(*model));
  const Worth worth = [&](const std::vector<size_t>& chosen, const Equipment& equipment) {
    double least = std::numeric_limits<double>::infinity();
    for (size_t a = 0; a < models.size(); ++a) {
      for (size_t b = 0; b < models.size(); ++b)
        if (a != b) {
          const Eigen::MatrixXd gram =
              gram_of(outlooks, chosen, a, b, equipment) +
              gram_beside(design.problem, *models[a], *models[b], equipment, design.knowledge);
          least = std::min(least, inference::separation(gram, known[b]));
        }
    }
    return least;
  };
  const Plan plan = plan_of(design.problem.session(), segments, clear_sigma, worth);
  if (plan.experiment.segments.empty()) return std::nullopt;
  NextExperiment next;
  for (const FittedModel* model : models)
    next.separates.push_back(ids_of(*model));
  next.predicted_separation_sigma = plan.worth;
  next.reason = fmt::format(
      "{}: there {} differ by {:.1f} standard deviations after the unknowns of each have adapted.{}",
      plan_words(plan.experiment), fmt::join(next.separates, " and "), plan.worth,
      plan.worth < 3.0 ? " That hardly tells them apart, but nothing that this rig can do tells more." : "");
  next.toml = to_toml(plan.experiment, fmt::format("Separates {}", fmt::join(next.separates, " from ")));
  return next;
}

std::optional<NextExperiment> sharpening_experiment(const ExperimentDesign& design,
                                                    const FittedModel& named) {
  const auto segments = possible_segments(design.limits);
  if (segments.empty() || named.model.terms.empty()) return std::nullopt;
  const auto outlooks = outlooks_of(design, {&named}, segments);
  const Eigen::MatrixXd known = known_before(named);
  const Eigen::MatrixXd before = inference::covariance_of_information(known).matrix;
  const LeastKnown target = least_known(design.problem.session(), named, before);
  const auto row = static_cast<Eigen::Index>(target.index);
  const Worth worth = [&](const std::vector<size_t>& chosen, const Equipment& equipment) {
    const Eigen::MatrixXd gram = gram_of(outlooks, chosen, 0, 0, equipment);
    const inference::Covariance after =
        inference::covariance_of_information(gram.bottomRightCorner(known.rows(), known.cols()) + known);
    return std::sqrt(before(row, row) / after.matrix(row, row));
  };
  constexpr double narrow_enough = 1.5;
  const Plan plan = plan_of(design.problem.session(), segments, narrow_enough, worth);
  if (plan.experiment.segments.empty()) return std::nullopt;
  const std::string& name = named.unknowns[target.index].name;
  const double error = named.errors[target.index];
  NextExperiment next;
  next.separates = {ids_of(named), "no effect"};
  next.predicted_separation_sigma = target.distance * plan.worth / std::sqrt(before(row, row));
  next.reason = fmt::format("{}: narrows the interval of {} most, from a standard error of {:.2g} to {:.2g}.",
                            plan_words(plan.experiment), name, error, error / plan.worth);
  next.toml = to_toml(plan.experiment, fmt::format("Narrows the interval of {}", name));
  return next;
}

std::optional<NextExperiment> exposing_experiment(const ExperimentDesign& design, const Misfit& worst) {
  const auto run = std::ranges::find_if(design.problem.session().runs, [&](const rig::SessionRun& candidate) {
    return worst.run == candidate.drive.place.name || worst.run == candidate.drive.place.name + ".run.h5";
  });
  if (run == design.problem.session().runs.end() || run->segments.empty()) return std::nullopt;
  const auto number = static_cast<size_t>(std::max(0, worst.segment.value_or(0)));
  const runfile::Segment& seen = run->segments[std::min(number, run->segments.size() - 1)];
  constexpr double seconds = 60.0;
  PlannedExperiment plan;
  runfile::Segment again = seen;
  again.cycles = std::max<int64_t>(seen.cycles, std::llround(seconds / seen.period_s));
  if (again.waveform == "hold") again.cycles = seen.cycles;
  plan.segments.push_back(again);
  if (again.waveform != "hold") {
    again.period_s = 2 * seen.period_s;
    again.cycles = std::max<int64_t>(1, plan.segments[0].cycles / 2);
    plan.segments.push_back(again);
  }
  if (plan.segments[0].waveform == "uploaded") return std::nullopt;
  plan.new_pump_sensor = !equipment_of(design.problem.session())[1];
  NextExperiment next;
  next.separates = {"unexplained in the " + worst.port, "noise"};
  next.predicted_separation_sigma =
      std::sqrt(std::max(0.0, worst.excess_chi2) * static_cast<double>(plan.segments[0].cycles) /
                static_cast<double>(std::max<int64_t>(seen.cycles, 1)));
  next.reason = fmt::format(
      "{}: the misfit is worst there. What keeps its phase at half the rate belongs to the motion, "
      "what keeps its frequency does not.",
      plan_words(plan));
  next.toml = to_toml(plan, fmt::format("Shows what is unexplained in the {} port", worst.port));
  return next;
}

}  // namespace diastole::explain
