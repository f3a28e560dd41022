#include "estimator/explain/explain_rig.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>

#include "estimator/explain/findings.hpp"
#include "estimator/explain/held_out.hpp"
#include "estimator/explain/tolerance.hpp"

namespace diastole::explain {
namespace {

constexpr double discovery_rate = 0.01;

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
  for (size_t count = 1; count <= best.ingredients.size(); ++count) {
    const std::vector<rig::Ingredient> part(best.ingredients.begin(),
                                            best.ingredients.begin() + static_cast<std::ptrdiff_t>(count));
    for (const FittedSet& set : search.sets) {
      if (set.fit.ingredients.size() != count) continue;
      const bool same = std::equal(part.begin(), part.end(), set.fit.ingredients.begin(),
                                   [](const auto& a, const auto& b) { return a.effect == b.effect; });
      if (!same) continue;
      steps.push_back({std::string(part.back().effect->text().id), set.fit.reduced()});
      break;
    }
  }
  return steps;
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
  const rig::SpecimenFamily family(study);
  tell("fitting the rig's model");
  rig::RigFitOptions fit_options;
  fit_options.threads = options.threads;
  const rig::RigProblem problem(session, family, fit_options);

  SearchOptions search_options;
  search_options.progress = options.progress;
  const SearchResult found = search(session, family, problem, search_options);
  const FittedSet& best = found.sets[found.best];

  tell("judging");
  const Eigen::VectorXd change = problem.base().residuals - best.fit.residuals;
  const auto cells =
      residual_cells(session, problem.blocks(), best.fit.residuals, model_variance(problem, change));
  std::vector<ResidualCell> left = significant(cells, discovery_rate);
  const size_t cell_count = cells.size();
  if (!is_structured(left, cell_count)) left.clear();
  const Judgement judgement = judge(found, left);

  Explanation out;
  out.study = study.file.string();
  out.verdict = judgement.verdict;
  out.ambiguous_with = judgement.ambiguous_with;
  const Eigen::VectorXd weights = row_weights(session, problem);
  const std::vector<double> errors = parameter_errors(best.fit, weights);
  if (judgement.verdict != Verdict::unexplained) out.effects = found_effects(best.fit, errors);
  const bool unexplained = judgement.verdict == Verdict::unexplained;
  const auto where = unexplained
                         ? judgement.left
                         : significant(residual_cells(session, problem.blocks(), problem.base().residuals,
                                                      model_variance(problem, {})),
                                       discovery_rate);
  if (out.verdict != Verdict::none) out.where = misfits(session, problem, where, {}, best.fit);
  out.gap = held_out_gap(session, problem, best.fit, weights);
  out.evidence = evidence(found, judgement, {});
  out.shifts = parameter_shifts(problem.base(), parameter_errors(problem.base(), weights), best.fit, errors);
  out.steps = steps_of(found);
  out.traces = traces(session, problem, problem.base(), best.fit);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  out.summary = summary_of(out);
  return out;
}

}  // namespace diastole::explain
