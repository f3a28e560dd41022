#include "estimator/explain/verdict.hpp"

#include <algorithm>

namespace diastole::explain {

bool is_structured(const std::vector<ResidualCell>& left, size_t cells) {
  return std::any_of(left.begin(), left.end(), [&](const ResidualCell& cell) {
    return cell.p_value * static_cast<double>(cells) < 1e-6;
  });
}

Judgement judge(const SearchResult& search, std::vector<ResidualCell> left) {
  Judgement judgement;
  judgement.left = std::move(left);
  const FittedSet& best = search.sets[search.best];
  for (size_t k = 0; k < search.sets.size(); ++k) {
    const FittedSet& other = search.sets[k];
    if (k == search.best || other.fit.ingredients.size() > best.fit.ingredients.size()) continue;
    if (other.chi_square < best.chi_square + as_good) judgement.ambiguous_with.push_back(other.ids());
  }
  if (!judgement.left.empty()) {
    judgement.verdict = Verdict::unexplained;
  } else if (best.fit.ingredients.empty()) {
    judgement.verdict = Verdict::none;
  } else {
    judgement.verdict = judgement.ambiguous_with.empty() ? Verdict::named : Verdict::ambiguous;
  }
  return judgement;
}

}  // namespace diastole::explain
