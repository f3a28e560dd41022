#include "estimator/explain/explain_study.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/imaging/explain_field.hpp"
#include "estimator/explain/verdict/verdict.hpp"
#include "estimator/model/study_model.hpp"
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

using Ids = std::vector<std::string>;

bool shows_in_both(const std::string& id) {
  const Effect* effect = find_effect(id);
  return effect != nullptr && !effect->parameters().empty() && !effect->field_parameters().empty();
}

Ids shared(const Ids& ids) {
  Ids both;
  std::ranges::copy_if(ids, std::back_inserter(both), shows_in_both);
  std::ranges::sort(both);
  return both;
}

/// An effect's values in images beside those in runs. Most have names of their own; of a quantity that both estimate the one that is
/// better known stands.
void add_estimates(std::vector<FoundParameter>& values, std::vector<FoundParameter> more) {
  const auto width = [](const FoundParameter& value) { return value.ci90[1] - value.ci90[0]; };
  for (FoundParameter& other : more) {
    const auto same = std::ranges::find(values, other.name, &FoundParameter::name);
    if (same == values.end()) {
      values.push_back(std::move(other));
    } else if (width(other) < width(*same)) {
      *same = std::move(other);
    }
  }
}

/// Those of the sets that are left open whose effects in both data are these, and their searches; nothing at all is not one of them,
/// which the other data exclude. If none but the best is left it is named, and what was said and proposed of the others goes.
void keep_agreeing(Explanation& explanation, const Ids& agreed) {
  const auto disagrees = [&](const Ids& ids) { return shared(ids) != agreed; };
  std::erase_if(explanation.ambiguous_with, disagrees);
  std::erase_if(explanation.searches, [&](const SearchEnd& search) {
    return !search.effects.empty() && disagrees(search.effects);
  });
  explanation.converged = is_settled(explanation.searches);
  if (!explanation.ambiguous_with.empty()) return;
  explanation.verdict = explanation.converged ? Verdict::named : Verdict::unexplained;
  if (!explanation.converged) explanation.effects.clear();
  explanation.confidence = {};
  explanation.next_experiment = {};
  explanation.summary = summary_of(explanation);
}

/// Where one explanation is named by an effect that shows in both data, and that is the best of what the other leaves open, the other's
/// question is answered.
void answer(Explanation& open, const Explanation& named) {
  if (open.verdict != Verdict::ambiguous || named.verdict != Verdict::named) return;
  Ids best, known;
  for (const FoundEffect& effect : open.effects)
    best.push_back(effect.id);
  for (const FoundEffect& effect : named.effects)
    known.push_back(effect.id);
  const Ids agreed = shared(known);
  if (!agreed.empty() && shared(best) == agreed) keep_agreeing(open, agreed);
}

}  // namespace

Study with_imaged_modulus(Study study, const Explanation& field) {
  /// Of a modulus from images beside what their fit says: lengths, and what tracking costs (facts of gels: 0.1 to 0.7 %).
  constexpr double beside_the_fit = 0.007;
  if (field.verdict != Verdict::none && field.verdict != Verdict::named) return study;
  if (study.law.parameters.empty()) return study;
  StudyParameter& modulus = study.law.parameters.front();
  const auto seen = std::ranges::find(field.law, modulus.name, &ParameterShift::name);
  if (seen == field.law.end() || !is_modulus(study, modulus) || !(seen->after > 0.0)) return study;
  if (!(seen->after_error > 0.0)) return study;  // it rests on its bound
  // A uniform distribution over the bounds has the standard deviation that is known.
  const double reach = std::exp(std::sqrt(3.0) * std::hypot(seen->after_error / seen->after, beside_the_fit));
  if (!(reach * reach < modulus.upper / modulus.lower)) return study;
  modulus.lower = seen->after / reach;
  modulus.upper = seen->after * reach;
  modulus.start = seen->after;
  return study;
}

Explanation merged(Explanation rig, Explanation field) {
  answer(rig, field);
  answer(field, rig);
  Explanation both = std::move(rig);
  const Verdict of_runs = both.verdict;
  if (both.verdict == Verdict::none) both.gap = field.gap;
  both.verdict = together(both.verdict, field.verdict);
  for (FoundEffect& effect : field.effects) {
    const auto same = std::ranges::find(both.effects, effect.id, &FoundEffect::id);
    if (same == both.effects.end()) {
      both.effects.push_back(std::move(effect));
    } else {
      add_estimates(same->parameters, std::move(effect.parameters));
    }
  }
  append(both.ambiguous_with, std::move(field.ambiguous_with));
  append(both.where, std::move(field.where));
  append(both.evidence, std::move(field.evidence));
  append(both.shifts, std::move(field.shifts));
  append(both.steps, std::move(field.steps));
  append(both.searches, std::move(field.searches));
  both.converged = both.converged && field.converged;
  if (both.verdict != of_runs) both.confidence = {};  // it is the runs' alone
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
  return merged(explain_rig(with_imaged_modulus(study, field), options), std::move(field));
}

}  // namespace diastole::explain
