#include "estimator/explain/verdict/verdict.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/verdict/chi_square.hpp"

namespace diastole::explain {
namespace {

constexpr double hint_probability = 1e-4;  // by chance, for each effect

/// Effects that alone gain nearly as much as the best, if that is more than chance suggests.
std::vector<std::vector<std::string>> hinted(const std::vector<Lead>& leads) {
  std::vector<std::vector<std::string>> sets;
  double best = 0.0;
  for (const Lead& lead : leads)
    if (lead.gain > chi_square_exceeded(hint_probability, static_cast<double>(lead.parameters)))
      best = std::max(best, lead.gain);
  for (const Lead& lead : leads)
    if (best > 0.0 && lead.gain > best - as_good) sets.push_back({std::string(lead.term.effect->text().id)});
  return sets;
}

/// Whether the chosen set predicts left-out data at least as well as the base model does.
bool predicts(const SearchResult& search, const Gap& gap) {
  const FittedSet& best = search.sets[search.best];
  for (const double number : {search.sets.front().chi_square, best.chi_square, gap.before})
    if (!std::isfinite(number)) return false;
  return best.fit.terms.empty() || gap.after <= gap.before;
}

}  // namespace

bool is_structured(const std::vector<ResidualCell>& left, size_t cells) {
  return std::any_of(left.begin(), left.end(), [&](const ResidualCell& cell) {
    return cell.p_value * static_cast<double>(cells) < 1e-6;
  });
}

Judgement judge(const SearchResult& search, std::vector<ResidualCell> left, const Gap& gap) {
  Judgement judgement;
  judgement.left = std::move(left);
  const FittedSet& best = search.sets[search.best];
  for (size_t k = 0; k < search.sets.size(); ++k) {
    const FittedSet& other = search.sets[k];
    if (k == search.best || other.fit.terms.size() > best.fit.terms.size()) continue;
    if (other.chi_square < best.chi_square + as_good) judgement.ambiguous_with.push_back(other.ids());
  }
  if (!judgement.left.empty() || !predicts(search, gap)) {
    judgement.verdict = Verdict::unexplained;
  } else if (best.fit.terms.empty()) {
    judgement.ambiguous_with = hinted(search.leads);
    judgement.verdict = judgement.ambiguous_with.empty() ? Verdict::none : Verdict::ambiguous;
  } else {
    judgement.verdict = judgement.ambiguous_with.empty() ? Verdict::named : Verdict::ambiguous;
  }
  return judgement;
}

}  // namespace diastole::explain
