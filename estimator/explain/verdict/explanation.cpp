#include "estimator/explain/verdict/explanation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace diastole::explain {

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

}  // namespace diastole::explain
