#include "estimator/explain/verdict/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace diastole::explain {

std::vector<std::string> ids_of(const std::vector<FoundEffect>& effects) {
  std::vector<std::string> ids;
  for (const FoundEffect& effect : effects)
    ids.push_back(effect.id);
  return ids;
}

std::string words_of(const std::vector<std::string>& ids, const char* none) {
  return ids.empty() ? none : fmt::format("{}", fmt::join(ids, " + "));
}

std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, 4> names{"named", "ambiguous", "unexplained", "none"};
  return names[static_cast<size_t>(verdict)];
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

bool may_be_nothing(const Explanation& found) {
  return !found.effects.empty() &&
         std::ranges::any_of(found.ambiguous_with, [](const auto& set) { return set.empty(); });
}

namespace {

std::string verdict_sentence(const Explanation& found) {
  const std::vector<std::string> ids = ids_of(found.effects);
  std::string unsettled;
  for (const SearchEnd& search : found.searches)
    if (!inference::is_settled(search.termination))
      unsettled +=
          fmt::format(" The search of {} did not converge: {}",
                      search.of_reference ? "the reference" : words_of(search.effects, "the base model"),
                      inference::sentence(search.termination));
  std::string others;
  for (const auto& other : found.ambiguous_with)
    others += (others.empty() ? "" : ", ") + words_of(other, "nothing that is known");
  switch (found.verdict) {
    case Verdict::none:
      if (!found.hints.empty()) {
        std::vector<std::string> hints;
        for (const Hint& hint : found.hints)
          hints.push_back(hint.id);
        return fmt::format("Nothing exceeds the model's own error; {} is hinted at, and smaller than that.{}",
                           words_of(hints, ""), unsettled);
      }
      return "Nothing exceeds the model's own error: the rig's model explains these recordings." + unsettled;
    case Verdict::named:
      return fmt::format(
          "The model lacks {}: with it {:.0f} % of the gap on data that were not fitted is closed.",
          words_of(ids, ""), 100.0 * found.gap.closed);
    case Verdict::ambiguous:
      if (ids.empty())
        return fmt::format("Too weak to name and too strong to be chance: perhaps {}, perhaps nothing.{}",
                           others, unsettled);
      if (may_be_nothing(found))
        return fmt::format("Too weak to name and too strong to be chance: perhaps {}, perhaps {}.{}",
                           words_of(ids, ""), others, unsettled);
      return fmt::format("The model lacks something that these data cannot tell apart: {}, or {}.{}",
                         words_of(ids, ""), others, unsettled);
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

}  // namespace

std::string place_of(const LearnedTerm& term) {
  const auto words = [](const auto& law) {
    return fmt::format("at the port {}, {} by {}", law.port, law.sets, fmt::join(law.variables, " and "));
  };
  std::string place = words(term);
  for (const LearnedRival& rival : term.rivals)
    place += ", or as well " + words(rival);
  return place;
}

std::string summary_of(const Explanation& found) {
  std::string summary = verdict_sentence(found);
  if (found.learned)
    summary += fmt::format(
        " A law that was learnt {}, closes {:.0f} % of the gap on waveforms that were not fitted: a "
        "suggestion, to be read and named.",
        place_of(*found.learned), 100.0 * found.learned->gap.closed);
  return summary;
}

}  // namespace diastole::explain
