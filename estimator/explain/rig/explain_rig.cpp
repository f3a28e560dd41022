#include "estimator/explain/rig/explain_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>

#include "estimator/explain/rig/findings.hpp"
#include "estimator/explain/rig/held_out.hpp"
#include "estimator/explain/rig/next_experiment.hpp"
#include "estimator/explain/rig/tolerance.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

constexpr double discovery_rate = 0.01;
constexpr double dominated = 0.1;  // of chi-square left by effects beside which a first search seeks no more
constexpr size_t most_hints = 2;   // that a next experiment is designed for, beside nothing at all
constexpr double other_variation =
    0.5;  // of chi-square left by effects that change what a cycle looks like, too

std::vector<Step> steps_of(const SearchResult& search) {
  std::vector<Step> steps{{"base model", search.sets.front().fit.reduced()}};
  const auto is_effect = [](const rig::ModelTerm& a, const rig::ModelTerm& b) {
    return a.effect == b.effect;
  };
  std::vector<rig::ModelTerm> part;
  for (const rig::ModelTerm& term : search.sets[search.best].fit.terms) {
    part.push_back(term);
    const auto set = std::ranges::find_if(search.sets, [&](const FittedSet& other) {
      return std::ranges::equal(part, other.fit.terms, is_effect);
    });
    if (set != search.sets.end()) steps.push_back({std::string(term.effect->text().id), set->fit.reduced()});
  }
  return steps;
}

/// The terms of the effects that the study's model has already, in its order.
std::vector<rig::ModelTerm> terms_of(const Study& study, const rig::Session& session) {
  std::vector<rig::ModelTerm> list;
  for (const std::string& id : study.effects) {
    const Effect* effect = find_effect(id);
    if (effect == nullptr) {
      throw InputError({.file = study.file.string(),
                        .place = "model.effects",
                        .problem = fmt::format("there is no effect \"{}\"", id),
                        .remedy = "`diastole effects` lists those that are known."});
    }
    rig::ModelTerm term{effect, {}};
    for (const StudyEffect& given : study.effect_values) {
      if (given.id != id) continue;
      for (const StudyMoment& moment : given.moments)
        for (const rig::SessionRun& run : session.runs)
          if (run.drive.place.name == moment.run)
            term.change_points.push_back(
                {moment.run, moment.time_s, run.drive.place.started_s + moment.time_s});
    }
    list.push_back(std::move(term));
  }
  return list;
}

/// The session as it would be without the effects of a fit: what the model says they do is taken off. Its cycles repeat,
/// so that the noise can be told.
rig::Session without_effects(const rig::Session& session, const rig::RigProblem& problem,
                             const rig::RigFit& fit) {
  rig::Session plain = session;
  const auto with = problem.predictions(fit);
  const auto base = problem.predictions({{}, {fit.values.begin(), fit.values.begin() + rig::nuisances}});
  for (size_t r = 0; r < plain.runs.size(); ++r) {
    for (auto& [channel, values] : plain.runs[r].pressure_kPa) {
      const bool cavity = channel == rig::Channel::cavity;
      const auto& now = cavity ? with[r].cavity_kPa : with[r].pump_kPa;
      const auto& then = cavity ? base[r].cavity_kPa : base[r].pump_kPa;
      for (size_t k = 0; k < values.size(); ++k)
        values[k] += then[k] - now[k];
    }
  }
  return plain;
}

bool differ(const rig::NoiseModel& a, const rig::NoiseModel& b) {
  constexpr double noise_part = 0.05;
  constexpr double cycle_part = 0.3;
  constexpr double smallest_cycle_sd = 5e-4;
  for (const auto& [channel, noise] : a.channels)
    if (std::abs(b.channels.at(channel).innovation_kPa / noise.innovation_kPa - 1.0) > noise_part)
      return true;
  return std::abs(a.cycle_sd - b.cycle_sd) > cycle_part * std::max(b.cycle_sd, smallest_cycle_sd);
}

/// The session's problem and what was found in it.
struct Work {
  rig::RigProblem problem;
  SearchResult found;
  Eigen::VectorXd weights;  ///< of the residuals' squares

  [[nodiscard]] const FittedSet& best() const { return found.sets[found.best]; }
};

/// A first search, and a second one if the effects had spoiled the estimate of the noise or are so large that strokes
/// vary otherwise with them.
Work searched(const rig::Session& session, const rig::SpecimenFamily& family, const Study& study,
              const ExplainOptions& options) {
  rig::RigFitOptions fitting;
  fitting.threads = options.threads;
  SearchOptions searching;
  searching.progress = options.progress;
  searching.start = terms_of(study, session);
  searching.enough = dominated;
  const auto work = [&]() -> Work {
    rig::RigProblem problem(session, family, fitting);
    if (fitting.variation_of)
      searching.change = problem.base().residuals - problem.residuals(*fitting.variation_of);
    SearchResult found = search(session, family, problem, searching);
    Eigen::VectorXd weights = row_weights(session, problem, searching.change);
    return {std::move(problem), std::move(found), std::move(weights)};
  };
  options.report("fitting the rig's model");
  Work first = work();
  const FittedSet& base = first.found.sets.front();
  const rig::RigFit& best = first.best().fit;
  if (best.terms.empty() || leaves_misfit(base, first.best())) return first;
  const rig::NoiseModel noise = rig::estimate_noise(without_effects(session, first.problem, best));
  const bool large = first.best().chi_square < other_variation * base.chi_square;
  if (!large && !differ(first.problem.noise(), noise)) return first;
  options.report("fitting again with the noise that is left");
  fitting.noise = noise;
  fitting.variation_of = best;
  searching.start = best.terms;
  searching.enough = 0.0;
  return work();
}

/// Of each effect found, the fit of the others alone, which the search made when it compared look-alikes.
std::vector<const rig::RigFit*> fits_without(const SearchResult& search, const rig::RigFit& best) {
  std::vector<const rig::RigFit*> fits;
  for (const rig::ModelTerm& left_out : best.terms) {
    std::vector<std::string> others;
    for (const rig::ModelTerm& in : best.terms)
      if (in.effect != left_out.effect) others.emplace_back(in.effect->text().id);
    std::sort(others.begin(), others.end());
    const auto made = std::find_if(search.sets.begin(), search.sets.end(),
                                   [&](const FittedSet& set) { return set.ids() == others; });
    fits.push_back(made == search.sets.end() ? nullptr : &made->fit);
  }
  return fits;
}

/// Where sets of one effect look alike, the port that most of them have, or the best one's; none if they have several
/// effects.
std::optional<std::string> common_port(const Explanation& found) {
  std::map<std::string, size_t> votes;
  const auto vote = [&](const std::string& id, size_t weight) {
    votes[std::string(name_of(find_effect(id)->text().port))] += weight;
  };
  if (found.effects.size() > 1) return {};
  for (const FoundEffect& best : found.effects)
    vote(best.id, 3);
  for (const std::vector<std::string>& ids : found.ambiguous_with) {
    if (ids.size() != 1) return {};
    vote(ids.front(), 2);
  }
  if (votes.empty()) return {};
  return std::ranges::max_element(votes, {}, [](const auto& port) { return port.second; })->first;
}

std::optional<NextExperiment> next_experiment(const Study& study, const rig::Session& session,
                                              const Work& work, const Explanation& found, size_t threads) {
  SpecimenKnowledge knowledge;
  if (const auto* annulus = std::get_if<AnnulusSpecimen>(&study.specimen))
    knowledge.inner_radius_mm = annulus->inner_radius_mm;
  const ExperimentDesign design{session, work.problem, limits_of(session), threads, knowledge};
  if (found.verdict == Verdict::unexplained && !found.where.empty())
    return exposing_experiment(design, found.where.front());
  if (found.verdict == Verdict::named) return sharpening_experiment(design, work.best().fit);
  if (found.verdict != Verdict::ambiguous) return {};
  std::vector<const rig::RigFit*> competing{&work.best().fit};
  std::vector<rig::RigFit> hinted;  // too weak to be fitted in the search
  if (found.effects.empty()) {
    for (const auto& ids : found.ambiguous_with)
      if (const Effect* effect = ids.size() == 1 ? find_effect(ids.front()) : nullptr;
          effect != nullptr && effect->change_points() == ChangePoints::none && hinted.size() < most_hints)
        hinted.push_back(work.problem.fit({{effect, {}}}));
    for (const rig::RigFit& fit : hinted)
      competing.push_back(&fit);
    return separating_experiment(design, competing);
  }
  for (const FittedSet& set : work.found.sets)
    if (std::find(found.ambiguous_with.begin(), found.ambiguous_with.end(), set.ids()) !=
        found.ambiguous_with.end())
      competing.push_back(&set.fit);
  return separating_experiment(design, competing);
}

}  // namespace

Explanation explain_rig(const Study& study, const ExplainOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  options.report("reading the runs");
  const rig::Session session = rig::read_session(study);
  options.report("computing the specimen");
  rig::SpecimenFamily family(study);
  family.compute_ahead();
  const Work work = searched(session, family, study, options);
  const rig::RigProblem& problem = work.problem;
  const rig::RigFit& base = problem.base();
  rig::RigFit best = work.best().fit;
  best.jacobian = problem.columns(best);  // at the very optimum

  options.report("judging");
  const auto cells = residual_cells(session, problem.blocks(), best.residuals,
                                    model_variance(problem, base.residuals - best.residuals));
  std::vector<ResidualCell> left = significant(cells, discovery_rate);
  if (!is_structured(left, cells.size())) left.clear();
  const Eigen::VectorXd& weights = work.weights;
  Explanation out;
  out.study = study.file.string();
  out.gap = held_out_gap(session, problem, best, weights);
  const SearchRecord record = record_of(work.found);
  const Judgement judgement = judge(record, !left.empty(), out.gap);
  out.verdict = judgement.verdict;
  out.searches = judgement.searches;
  out.converged = is_settled(out.searches);
  const std::vector<double> errors = parameter_errors(best, weights, base.chi_square - best.chi_square);
  if (judgement.verdict == Verdict::unexplained) {  // nothing is added, so that nothing is closed
    out.gap.after = out.gap.before;
    out.gap.closed = 0.0;
  } else {
    out.ambiguous_with = judgement.ambiguous_with;
    out.effects = found_effects(best, errors);
  }
  if (!left.empty()) {
    out.where = misfits(session, problem, left, {}, base);
  } else if (out.verdict != Verdict::none) {
    const auto before =
        residual_cells(session, problem.blocks(), base.residuals, model_variance(problem, {}));
    out.where =
        misfits(session, problem, significant(before, discovery_rate), fits_without(work.found, best), best);
  }
  if (const auto port = common_port(out); port && out.verdict == Verdict::ambiguous)
    for (Misfit& place : out.where)
      place.port = *port;
  out.evidence = evidence(record, judgement);
  if (!out.effects.empty())
    out.shifts = parameter_shifts(base, parameter_errors(base, weights, 0.0), best, errors);
  out.steps = steps_of(work.found);
  out.traces = traces(session, problem, base, best);
  options.report("designing the next experiment");
  if (options.propose) out.next_experiment = next_experiment(study, session, work, out, options.threads);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  out.summary = summary_of(out);
  return out;
}

}  // namespace diastole::explain
