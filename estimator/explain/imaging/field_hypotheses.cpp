#include "estimator/explain/imaging/field_hypotheses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "estimator/explain/imaging/inclusion_fit.hpp"
#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/inference/tail_probability.hpp"

namespace diastole::explain {
namespace {

FieldChoice with_essentials(const Effect& effect, std::vector<double> values) {
  FieldChoice choice{{&effect}, std::move(values), {}};
  for (size_t i = 0; i < effect.field_essentials(); ++i)
    choice.free.push_back(i);
  return choice;
}

/// The start of an effect with a direction: the one in which a little of it would gain most.
std::vector<double> start_in_direction(FieldProblem& problem, const FieldFit& base, const Effect& effect,
                                       const FieldDirection& direction) {
  constexpr int directions = 12;
  std::vector<double> values = effect.field_neutral(problem.field().base);
  const double typical = effect.field_parameters()[0].typical;
  const double little = typical / 300.0;
  std::vector<FieldPerturbation> perturbations;
  for (int i = 0; i < directions; ++i) {
    FieldPerturbation perturbation{problem.field().base, problem.field().base, 2.0 * little};
    values[direction.parameter] = direction.half_turn * i / directions;
    values[0] = little;
    effect.apply_to_field(values, perturbation.up);
    values[0] = -little;
    effect.apply_to_field(values, perturbation.down);
    perturbations.push_back(perturbation);
  }
  const size_t loudest = problem.highest_node();
  const FieldSolver::Slopes slopes = problem.solver().slopes(loudest, perturbations);
  std::vector<double> shares;
  for (const double pressure_kPa : base.pressures_kPa)
    shares.push_back(std::pow(pressure_kPa / problem.nodes_kPa()[loudest], 2));
  const LinearEvidence evidence(base, problem.rows().columns(problem.solver().mesh(), slopes.model, shares));
  values = effect.field_neutral(problem.field().base);
  values[0] = typical;
  double best = 0.0;
  for (int i = 0; i < directions; ++i) {
    const double amount = evidence.amount(i);
    if (amount <= 0.0 || evidence.gain(i) < best) continue;
    best = evidence.gain(i);
    values[0] = std::clamp(amount, typical / 30.0, typical * 20.0 / 3.0);
    values[direction.parameter] = direction.half_turn * i / directions;
  }
  return values;
}

std::vector<double> start_of(FieldProblem& problem, const FieldFit& base, const Effect& effect) {
  if (const auto direction = effect.field_direction())
    return start_in_direction(problem, base, effect, *direction);
  std::vector<double> values = effect.field_neutral(problem.field().base);
  const EffectParameter& size = effect.field_parameters()[0];
  values[0] = size.neutral != 0.0 && size.scale == SearchScale::linear
                  ? values[0] * size.typical / size.neutral
                  : size.typical;
  return values;
}

/// The essentials first, then all parameters if they pay.
FieldFit refit(FieldProblem& problem, FieldChoice choice, const FieldProblem::Start& start) {
  FieldFit fit = problem.fit(choice, start);
  if (choice.free.size() == choice.values.size()) return fit;
  FieldChoice all = fit.choice;
  for (size_t i = choice.free.size(); i < choice.values.size(); ++i) {
    all.free.push_back(i);
    const EffectParameter& parameter = choice.parameter(i);
    if (parameter.scale == SearchScale::linear) all.values[i] = parameter.typical;
  }
  FieldFit fuller = problem.fit(std::move(all), {fit.C1_kPa(), fit.pressures_kPa});
  return fit.chi_square - fuller.chi_square > worth_freeing ? fuller : fit;
}

constexpr size_t inclusions_fitted = 2;  // effects beside which an inclusion is refined

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
  pair.p_value = std::min(
      1.0, pairs_tried() * places * inference::chi_square_tail(std::max(0.0, pair.gain - alone), added));
  return pair;
}

FieldHypothesis fit_both(FieldProblem& problem, const FieldFit& base, const FieldHypothesis& first,
                         const FieldHypothesis& second) {
  const FieldFit& start = first.fit;
  FieldFit fit =
      problem.fit(together(first.fit.choice, second.fit.choice), {start.C1_kPa(), start.pressures_kPa});
  const auto parameters = static_cast<double>(fit.choice.free.size());
  return judged(std::move(fit), base, first, second, parameters, 1.0);
}

/// Inclusions beside the effects for which the lattice promises most.
std::vector<FieldHypothesis> inclusions_beside(const FieldProblem& problem, const FieldFit& base,
                                               const std::vector<const FieldHypothesis*>& others,
                                               const InclusionLattice& lattice) {
  struct Candidate {
    const FieldHypothesis* other;
    InclusionGuess guess;
    double gain;
  };
  const double volume_mm3 = wall_volume_mm3(problem.field().base);
  std::vector<Candidate> candidates;
  for (const FieldHypothesis* other : others) {
    const InclusionGuess guess = search_inclusion(lattice, volume_mm3, other->fit).front();
    if (guess.p_value < beyond_chance) candidates.push_back({other, guess, other->gain + guess.gain});
  }
  std::ranges::stable_sort(candidates, std::greater{}, &Candidate::gain);
  if (candidates.size() > inclusions_fitted) candidates.resize(inclusions_fitted);
  std::vector<FieldHypothesis> pairs;
  for (const Candidate& candidate : candidates) {
    const FieldHypothesis inclusion{{std::string(inclusion_effect().text().id)}, {}};
    FieldFit fit =
        fit_inclusion(problem, candidate.other->fit, candidate.guess.inclusion, InclusionEffort::once);
    if (fit.chi_square < candidate.other->fit.chi_square && &candidate == &candidates.front())
      fit = fit_inclusion(problem, candidate.other->fit, inclusion_of(fit), InclusionEffort::fully);
    const double parameters =
        effective_parameters + static_cast<double>(candidate.other->fit.choice.free.size());
    pairs.push_back(
        judged(std::move(fit), base, *candidate.other, inclusion, parameters, distinct_places(volume_mm3)));
  }
  return pairs;
}

}  // namespace

std::string FieldHypothesis::name() const { return fmt::format("{}", fmt::join(ids, " + ")); }

bool FieldHypothesis::has_inclusion() const {
  return std::ranges::find(ids, inclusion_effect().text().id) != ids.end();
}

std::vector<FieldHypothesis> fit_round_effects(FieldProblem& problem, const FieldFit& base) {
  std::vector<FieldHypothesis> result;
  const FieldProblem::Start start{base.C1_kPa(), base.pressures_kPa};
  std::vector<FieldChoice> choices;  // made before the first fit, which moves the solver
  for (const Effect* effect : field_effects())
    if (!effect->is_inclusion())
      choices.push_back(with_essentials(*effect, start_of(problem, base, *effect)));
  for (FieldChoice& choice : choices) {
    FieldHypothesis tried{{std::string(choice.effects.front()->text().id)}, {}};
    tried.fit = refit(problem, std::move(choice), start);
    tried.gain = base.chi_square - tried.fit.chi_square;
    const auto parameters = static_cast<double>(tried.fit.choice.free.size());
    tried.score = tried.gain - 2.0 * parameters;
    tried.p_value = std::min(1.0, static_cast<double>(field_effects().size()) *
                                      inference::chi_square_tail(tried.gain, parameters));
    result.push_back(std::move(tried));
  }
  return result;
}

std::vector<FieldHypothesis> try_inclusion(const FieldProblem& problem, const FieldFit& base,
                                           const std::vector<InclusionGuess>& guesses, double to_beat) {
  if (guesses.front().p_value > suspected) return {};
  constexpr double near = 20.0;
  FieldHypothesis tried{{std::string(inclusion_effect().text().id)},
                        fit_inclusion(problem, base, guesses.front().inclusion, InclusionEffort::once)};
  const auto judge = [&] {
    tried.gain = base.chi_square - tried.fit.chi_square;
    tried.score = tried.gain - 2.0 * effective_parameters -
                  2.0 * std::log(distinct_places(wall_volume_mm3(problem.field().base)));
  };
  judge();
  if (tried.score > to_beat - near && tried.gain > 0.0) {
    tried.fit = fit_inclusion(problem, base, inclusion_of(tried.fit), InclusionEffort::fully);
    judge();
  }
  tried.p_value = std::min(1.0, static_cast<double>(field_effects().size()) * guesses.front().p_value);
  return {std::move(tried)};
}

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
