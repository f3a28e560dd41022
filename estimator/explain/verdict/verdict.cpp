#include "estimator/explain/verdict/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimator/explain/verdict/chi_square.hpp"

namespace diastole::explain {
namespace {

constexpr double hint_probability = 1e-4;  // by chance, for each effect

/// Effects that alone gain nearly as much as the best, if that is more than chance suggests.
std::vector<std::vector<std::string>> hinted(const std::vector<ScreenedEffect>& screened) {
  std::vector<std::vector<std::string>> sets;
  double best = 0.0;
  for (const ScreenedEffect& effect : screened)
    if (effect.gain > chi_square_exceeded(hint_probability, static_cast<double>(effect.parameters)))
      best = std::max(best, effect.gain);
  for (const ScreenedEffect& effect : screened)
    if (best > 0.0 && effect.gain > best - as_good) sets.push_back({effect.id});
  return sets;
}

/// Whether the chosen set predicts left-out data at least as well as the base model does.
bool predicts(const SearchRecord& search, const Gap& gap) {
  const FittedEffects& best = search.sets[search.best];
  for (const double number : {search.sets.front().chi_square, best.chi_square, gap.before})
    if (!std::isfinite(number)) return false;
  return best.ids.empty() || gap.after <= gap.before;
}

std::string in_words(const std::vector<std::string>& ids, const char* none) {
  return ids.empty() ? none : fmt::format("{}", fmt::join(ids, " + "));
}

}  // namespace

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::named:
      return "named";
    case Verdict::ambiguous:
      return "ambiguous";
    case Verdict::unexplained:
      return "unexplained";
    case Verdict::none:
      return "none";
  }
  return "none";
}

Verdict verdict_named(std::string_view word) {
  for (const Verdict verdict : {Verdict::named, Verdict::ambiguous, Verdict::unexplained, Verdict::none})
    if (name_of(verdict) == word) return verdict;
  throw std::invalid_argument(fmt::format("\"{}\" is no verdict", word));
}

bool is_settled(const std::vector<SearchEnd>& searches) {
  return std::ranges::all_of(
      searches, [](const SearchEnd& search) { return inference::is_settled(search.termination); });
}

Judgement judge(const SearchRecord& search, bool structure_left, const Gap& gap) {
  Judgement judgement;
  const FittedEffects& base = search.sets.front();
  const FittedEffects& best = search.sets[search.best];
  judgement.searches.push_back({{}, base.termination});
  if (search.best != 0) judgement.searches.push_back({best.ids, best.termination});
  const bool settled = is_settled(judgement.searches);
  for (size_t k = 0; k < search.sets.size(); ++k) {
    const FittedEffects& other = search.sets[k];
    if (k == search.best || other.ids.size() > best.ids.size()) continue;
    if (!(other.chi_square < best.chi_square + as_good)) continue;
    judgement.ambiguous_with.push_back(other.ids);
    if (k != 0) judgement.searches.push_back({other.ids, other.termination});
  }
  if (structure_left || !settled || !predicts(search, gap)) {
    judgement.verdict = Verdict::unexplained;
    return judgement;
  }
  if (best.ids.empty()) judgement.ambiguous_with = hinted(search.screened);
  judgement.verdict = !judgement.ambiguous_with.empty() ? Verdict::ambiguous
                      : best.ids.empty()                ? Verdict::none
                                                        : Verdict::named;
  return judgement;
}

std::vector<Candidate> evidence(const SearchRecord& search, const Judgement& judgement) {
  std::vector<Candidate> list;
  const FittedEffects& best = search.sets[search.best];
  for (size_t k = 1; k < search.sets.size(); ++k) {
    const FittedEffects& set = search.sets[k];
    Candidate row{set.ids, search.sets.front().chi_square - set.chi_square, true, set.parameters, {}, ""};
    if (k == search.best) {
      row.verdict = judgement.verdict == Verdict::unexplained ? "fits best, and not well enough" : "named";
    } else if (std::ranges::count(judgement.ambiguous_with, set.ids) > 0) {
      row.verdict = "as good";
    } else if (set.chi_square < best.chi_square + as_good) {
      row.verdict = "not needed: no better than the smaller set";
    } else {
      row.verdict = fmt::format("refuted: {:.1f} sigma worse", std::sqrt(set.chi_square - best.chi_square));
    }
    if (!inference::is_settled(set.termination)) row.verdict += "; its search did not end";
    list.push_back(std::move(row));
  }
  for (const ScreenedEffect& effect : search.screened) {
    const std::vector<std::string> ids{effect.id};
    if (std::ranges::none_of(list, [&](const Candidate& row) { return row.refitted && row.ids == ids; }))
      list.push_back({ids,
                      effect.gain,
                      false,
                      effect.parameters,
                      {},
                      effect.visibility < 3.0 ? "not visible in these data" : "screened out"});
  }
  std::ranges::sort(list, std::greater(), &Candidate::chi_square_drop);
  return list;
}

std::string summary_of(const Explanation& found) {
  std::vector<std::string> ids;
  for (const FoundEffect& effect : found.effects)
    ids.push_back(effect.id);
  std::string unsettled;
  for (const SearchEnd& search : found.searches)
    if (!inference::is_settled(search.termination))
      unsettled +=
          fmt::format(" The search of {} did not converge: {}", in_words(search.effects, "the base model"),
                      inference::sentence(search.termination));
  std::string others;
  for (const auto& other : found.ambiguous_with)
    others += (others.empty() ? "" : ", ") + in_words(other, "nothing at all");
  switch (found.verdict) {
    case Verdict::none:
      if (!found.hints.empty()) {
        std::vector<std::string> hints;
        for (const Hint& hint : found.hints)
          hints.push_back(hint.id);
        return fmt::format("Nothing exceeds the model's own error; {} is hinted at, and smaller than that.{}",
                           in_words(hints, ""), unsettled);
      }
      return "Nothing exceeds the noise: the rig's model explains these recordings." + unsettled;
    case Verdict::named:
      return fmt::format(
          "The model lacks {}: with it {:.0f} % of the gap on data that were not fitted is closed.",
          in_words(ids, ""), 100.0 * found.gap.closed);
    case Verdict::ambiguous:
      if (ids.empty())
        return fmt::format("Too weak to name and too strong to be chance: perhaps {}, perhaps nothing.{}",
                           others, unsettled);
      return fmt::format("The model lacks something that these data cannot tell apart: {}, or {}.{}",
                         in_words(ids, ""), others, unsettled);
    case Verdict::unexplained:
      if (!unsettled.empty()) return "Nothing can be named." + unsettled;
      return found.where.empty()
                 ? "The misfit has structure that no known effect removes."
                 : fmt::format(
                       "The misfit has structure that no known effect removes, most of it in {} of {}.",
                       found.where.front().channel, found.where.front().run);
  }
  return "";
}

}  // namespace diastole::explain
