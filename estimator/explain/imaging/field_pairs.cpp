#include "estimator/explain/imaging/field_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "estimator/explain/imaging/inclusion_fit.hpp"
#include "estimator/explain/verdict/chi_square.hpp"

namespace diastole::explain {
namespace {

constexpr size_t firsts = 2;             // single effects that get partners
constexpr size_t inclusions_fitted = 2;  // effects beside which an inclusion is refined
constexpr double beyond_chance = 1e-3;
constexpr double effective_parameters = 5.0;  // as for an inclusion alone: its sizes are tied to one another

double pairs_tried() {
  const auto effects = static_cast<double>(field_effects().size());
  return 0.5 * effects * (effects - 1.0);
}

/// Gain, score and p-value of a joint fit.
FieldHypothesis judged(FieldFit fit, const FieldFit& base, const FieldHypothesis& a, const FieldHypothesis& b,
                       double parameters, double places) {
  FieldHypothesis pair{{a.ids.front(), b.ids.front()}, std::move(fit)};
  std::ranges::sort(pair.ids);
  pair.gain = base.chi_square - pair.fit.chi_square;
  pair.score = pair.gain - 2.0 * parameters - 2.0 * std::log(pairs_tried() * places);
  const double alone = std::max(a.gain, b.gain);
  const double added = parameters - 1.0;
  pair.p_value =
      std::min(1.0, pairs_tried() * places * chi_square_tail(std::max(0.0, pair.gain - alone), added));
  return pair;
}

FieldHypothesis fit_both(FieldProblem& problem, const FieldFit& base, const FieldHypothesis& first,
                         const FieldHypothesis& second) {
  const FieldFit& start = first.fit;
  FieldFit fit =
      problem.fit(together(first.fit.choice, second.fit.choice), {start.C1_kPa, start.pressures_kPa});
  const auto parameters = static_cast<double>(fit.choice.free.size());
  return judged(std::move(fit), base, first, second, parameters, 1.0);
}

/// Inclusions beside the effects for which the lattice promises most.
std::vector<FieldHypothesis> inclusions_beside(const FieldProblem& problem, const FieldFit& base,
                                               const std::vector<const FieldHypothesis*>& others,
                                               const InclusionLattice& lattice) {
  struct Promise {
    const FieldHypothesis* other;
    InclusionGuess guess;
    double gain;
  };
  const FieldModel& body = problem.field().base;
  std::vector<Promise> promises;
  for (const FieldHypothesis* other : others) {
    const InclusionGuess guess = search_inclusion(lattice, body, other->fit).front();
    if (guess.p_value < beyond_chance) promises.push_back({other, guess, other->gain + guess.gain});
  }
  std::ranges::stable_sort(promises, std::greater{}, &Promise::gain);
  if (promises.size() > inclusions_fitted) promises.resize(inclusions_fitted);
  std::vector<FieldHypothesis> pairs;
  for (const Promise& promise : promises) {
    const FieldHypothesis inclusion{{std::string(inclusion_effect().text().id)}, {}};
    FieldFit fit = fit_inclusion(problem, promise.other->fit, promise.guess.inclusion, InclusionEffort::once);
    if (fit.chi_square < promise.other->fit.chi_square && &promise == &promises.front())
      fit = fit_inclusion(problem, promise.other->fit, inclusion_of(fit), InclusionEffort::fully);
    const double parameters =
        effective_parameters + static_cast<double>(promise.other->fit.choice.free.size());
    pairs.push_back(
        judged(std::move(fit), base, *promise.other, inclusion, parameters, distinct_places(body)));
  }
  return pairs;
}

}  // namespace

std::vector<FieldHypothesis> fit_pairs(FieldProblem& problem, const FieldFit& base,
                                       const std::vector<FieldHypothesis>& singles,
                                       const InclusionLattice& lattice) {
  std::vector<FieldHypothesis> pairs;
  std::vector<const FieldHypothesis*> beside_inclusion;
  const size_t begun = std::min(firsts, singles.size());
  for (size_t a = 0; a < singles.size(); ++a) {
    if (singles[a].has_inclusion()) continue;
    const bool inclusion_leads =
        std::any_of(singles.begin(), singles.begin() + static_cast<std::ptrdiff_t>(begun),
                    [](const FieldHypothesis& single) { return single.has_inclusion(); });
    if (a < begun || inclusion_leads) beside_inclusion.push_back(&singles[a]);
    for (size_t b = a + 1; a < begun && b < singles.size(); ++b)
      if (!singles[b].has_inclusion()) pairs.push_back(fit_both(problem, base, singles[a], singles[b]));
  }
  std::ranges::move(inclusions_beside(problem, base, beside_inclusion, lattice), std::back_inserter(pairs));
  std::ranges::stable_sort(pairs, std::greater{}, &FieldHypothesis::score);
  return pairs;
}

}  // namespace diastole::explain
