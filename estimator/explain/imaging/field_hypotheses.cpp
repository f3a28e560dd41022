#include "estimator/explain/imaging/field_hypotheses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "estimator/explain/imaging/inclusion_fit.hpp"
#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/explain/verdict/chi_square.hpp"

namespace diastole::explain {
namespace {

constexpr double worth_freeing = 9.0;  // gain of chi2 by which further parameters of an effect must pay
constexpr double beyond_chance = 1e-2;

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
  FieldFit fuller = problem.fit(std::move(all), {fit.C1_kPa, fit.pressures_kPa});
  return fit.chi_square - fuller.chi_square > worth_freeing ? fuller : fit;
}

}  // namespace

std::string FieldHypothesis::name() const { return fmt::format("{}", fmt::join(ids, " + ")); }

bool FieldHypothesis::has_inclusion() const {
  return std::ranges::find(ids, inclusion_effect().text().id) != ids.end();
}

std::vector<FieldHypothesis> fit_round_effects(FieldProblem& problem, const FieldFit& base) {
  std::vector<FieldHypothesis> result;
  const FieldProblem::Start start{base.C1_kPa, base.pressures_kPa};
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
    tried.p_value =
        std::min(1.0, static_cast<double>(field_effects().size()) * chi_square_tail(tried.gain, parameters));
    result.push_back(std::move(tried));
  }
  return result;
}

std::vector<FieldHypothesis> try_inclusion(const FieldProblem& problem, const FieldFit& base,
                                           const std::vector<InclusionGuess>& guesses, double to_beat) {
  if (guesses.front().p_value > beyond_chance) return {};
  constexpr double effective_parameters = 5.0;  // sizes are tied to one another
  constexpr double near = 20.0;
  FieldHypothesis tried{{std::string(inclusion_effect().text().id)},
                        fit_inclusion(problem, base, guesses.front().inclusion, InclusionEffort::once)};
  const auto judge = [&] {
    tried.gain = base.chi_square - tried.fit.chi_square;
    tried.score =
        tried.gain - 2.0 * effective_parameters - 2.0 * std::log(distinct_places(problem.field().base));
  };
  judge();
  if (tried.score > to_beat - near && tried.gain > 0.0) {
    tried.fit = fit_inclusion(problem, base, inclusion_of(tried.fit), InclusionEffort::fully);
    judge();
  }
  tried.p_value = std::min(1.0, static_cast<double>(field_effects().size()) * guesses.front().p_value);
  return {std::move(tried)};
}

}  // namespace diastole::explain
