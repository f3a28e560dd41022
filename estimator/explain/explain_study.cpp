#include "estimator/explain/explain_study.hpp"

#include <algorithm>
#include <iterator>

#include "estimator/explain/imaging/explain_field.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

template <class Item>
void append(std::vector<Item>& to, std::vector<Item> more) {
  std::move(more.begin(), more.end(), std::back_inserter(to));
}

Verdict together(Verdict a, Verdict b) {
  for (const Verdict verdict : {Verdict::unexplained, Verdict::ambiguous, Verdict::named})
    if (a == verdict || b == verdict) return verdict;
  return Verdict::none;
}

}  // namespace

Explanation merged(Explanation rig, Explanation field) {
  Explanation both = std::move(rig);
  if (both.verdict == Verdict::none) both.gap = field.gap;
  both.verdict = together(both.verdict, field.verdict);
  for (FoundEffect& effect : field.effects) {
    const auto same = std::ranges::find(both.effects, effect.id, &FoundEffect::id);
    if (same == both.effects.end()) {
      both.effects.push_back(std::move(effect));
    } else {
      append(same->parameters, std::move(effect.parameters));
    }
  }
  append(both.ambiguous_with, std::move(field.ambiguous_with));
  append(both.where, std::move(field.where));
  append(both.evidence, std::move(field.evidence));
  append(both.shifts, std::move(field.shifts));
  append(both.steps, std::move(field.steps));
  append(both.searches, std::move(field.searches));
  both.converged = both.converged && field.converged;
  both.field = std::move(field.field);
  both.summary = "Runs: " + both.summary + " Images: " + field.summary;
  both.seconds += field.seconds;
  return both;
}

Explanation explain_study(const Study& study, const ExplainOptions& options) {
  const bool imaged = study.data.tags || study.data.points;
  if (study.data.runs.empty() && !imaged) {
    throw InputError({study.file.string(), "data",
                      "names no run files, no tags and no points, so that there is nothing to explain",
                      "List the session's runs: runs = [\"baseline.run.h5\"], or tags and frames."});
  }
  if (!imaged) return explain_rig(study, options);
  Explanation field = explain_field(study, options.progress);
  if (study.data.runs.empty()) {
    if (options.learn) field.not_learned = "that takes runs, and the study has images only";
    return field;
  }
  return merged(explain_rig(study, options), std::move(field));
}

}  // namespace diastole::explain
