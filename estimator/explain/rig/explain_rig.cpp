#include "estimator/explain/rig/explain_rig.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

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

std::string summary_of(const Explanation& found) {
  std::vector<std::string> ids;
  for (const FoundEffect& effect : found.effects)
    ids.push_back(effect.id);
  const std::string set = fmt::format("{}", fmt::join(ids, " + "));
  switch (found.verdict) {
    case Verdict::none:
      return "Nothing exceeds the noise: the rig's model explains these recordings.";
    case Verdict::named:
      return fmt::format(
          "The model lacks {}: with it {:.0f} % of the gap on data that were not fitted is closed.", set,
          100.0 * found.gap.closed);
    case Verdict::ambiguous: {
      std::string others;
      for (const auto& other : found.ambiguous_with)
        others += fmt::format("{}{}", others.empty() ? "" : ", ",
                              other.empty() ? "nothing at all" : fmt::format("{}", fmt::join(other, " + ")));
      if (found.effects.empty())
        return fmt::format("Too weak to name and too strong to be chance: perhaps {}, perhaps nothing.",
                           others);
      return fmt::format("The model lacks something that these data cannot tell apart: {}, or {}.", set,
                         others);
    }
    case Verdict::unexplained:
      return found.where.empty()
                 ? "The misfit has structure that no known effect removes."
                 : fmt::format(
                       "The misfit has structure that no known effect removes, most of it in {} of {}.",
                       found.where.front().channel, found.where.front().run);
  }
  return "";
}

std::vector<Step> steps_of(const SearchResult& search) {
  std::vector<Step> steps{{"base model", search.sets.front().fit.reduced()}};
  const rig::RigFit& best = search.sets[search.best].fit;
  for (size_t count = 1; count <= best.terms.size(); ++count) {
    const std::vector<rig::ModelTerm> part(best.terms.begin(),
                                           best.terms.begin() + static_cast<std::ptrdiff_t>(count));
    for (const FittedSet& set : search.sets) {
      if (set.fit.terms.size() != count) continue;
      const bool same = std::equal(part.begin(), part.end(), set.fit.terms.begin(),
                                   [](const auto& a, const auto& b) { return a.effect == b.effect; });
      if (!same) continue;
      steps.push_back({std::string(part.back().effect->text().id), set.fit.reduced()});
      break;
    }
  }
  return steps;
}

/// The effects that the study's model has already, in its order.
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
    for (const StudyEffect& told : study.effect_values) {
      if (told.id != id) continue;
      for (const StudyMoment& moment : told.moments)
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
  const auto with = problem.predictions(fit.terms, fit.values);
  const auto base = problem.predictions({}, {fit.values.begin(), fit.values.begin() + 3});
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
  const auto tell = [&](const std::string& text) {
    if (options.progress) options.progress(text);
  };
  tell("fitting the rig's model");
  rig::RigFitOptions fitting;
  fitting.threads = options.threads;
  SearchOptions searching;
  searching.progress = options.progress;
  searching.start = terms_of(study, session);
  searching.enough = dominated;
  rig::RigProblem problem(session, family, fitting);
  SearchResult found = search(session, family, problem, searching);
  const rig::RigFit& best = found.sets[found.best].fit;
  const rig::NoiseModel noise = rig::estimate_noise(without_effects(session, problem, best));
  const bool large = found.sets[found.best].chi_square < other_variation * found.sets.front().chi_square;
  const bool hopeless = leaves_misfit(found.sets.front(), found.sets[found.best]);
  if (!best.terms.empty() && !hopeless && (large || differ(problem.noise(), noise))) {
    tell("fitting again with the noise that is left");
    fitting.noise = noise;
    fitting.variation_of = rig::KnownModel{best.terms, best.values};
    searching.start = best.terms;
    searching.enough = 0.0;
    rig::RigProblem again(session, family, fitting);
    searching.change = again.base().residuals - again.residuals(best.terms, best.values);
    SearchResult second = search(session, family, again, searching);
    Eigen::VectorXd weights = row_weights(session, again, searching.change);
    return {std::move(again), std::move(second), std::move(weights)};
  }
  Eigen::VectorXd weights = row_weights(session, problem, searching.change);
  return {std::move(problem), std::move(found), std::move(weights)};
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
  const ExperimentDesign design{session, work.problem, ExperimentLimits::of(session), threads, knowledge};
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
  const auto tell = [&](const std::string& text) {
    if (options.progress) options.progress(text);
  };
  tell("reading the runs");
  const rig::Session session = rig::read_session(study);
  tell("computing the specimen");
  rig::SpecimenFamily family(study);
  family.compute_ahead();
  const Work work = searched(session, family, study, options);
  const rig::RigProblem& problem = work.problem;
  const rig::RigFit& base = problem.base();
  rig::RigFit best = work.best().fit;
  best.jacobian = problem.columns(best.terms, best.values);  // at the very optimum

  tell("judging");
  const auto cells = residual_cells(session, problem.blocks(), best.residuals,
                                    model_variance(problem, base.residuals - best.residuals));
  std::vector<ResidualCell> left = significant(cells, discovery_rate);
  if (!is_structured(left, cells.size())) left.clear();
  const Eigen::VectorXd& weights = work.weights;
  const Gap gap = held_out_gap(session, problem, best, weights);
  const Judgement judgement = judge(work.found, left, gap);

  Explanation out;
  out.study = study.file.string();
  out.verdict = judgement.verdict;
  out.gap = gap;
  const double explained = base.chi_square - best.chi_square;
  const std::vector<double> errors = parameter_errors(best, weights, explained);
  if (judgement.verdict == Verdict::unexplained) {  // nothing is added, so that nothing is closed
    out.gap.after = gap.before;
    out.gap.closed = 0.0;
  } else {
    out.ambiguous_with = judgement.ambiguous_with;
    out.effects = found_effects(best, errors);
  }
  if (!judgement.left.empty()) {
    out.where = misfits(session, problem, judgement.left, {}, base);
  } else if (out.verdict != Verdict::none) {
    const auto before =
        residual_cells(session, problem.blocks(), base.residuals, model_variance(problem, {}));
    out.where =
        misfits(session, problem, significant(before, discovery_rate), fits_without(work.found, best), best);
  }
  if (const auto port = common_port(out); port && out.verdict == Verdict::ambiguous)
    for (Misfit& place : out.where)
      place.port = *port;
  out.evidence = evidence(work.found, judgement, {});
  if (!out.effects.empty())
    out.shifts = parameter_shifts(base, parameter_errors(base, weights, 0.0), best, errors);
  out.steps = steps_of(work.found);
  out.traces = traces(session, problem, base, best);
  tell("designing the next experiment");
  if (options.propose) out.next_experiment = next_experiment(study, session, work, out, options.threads);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  out.summary = summary_of(out);
  return out;
}

}  // namespace diastole::explain
