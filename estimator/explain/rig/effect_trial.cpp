#include "estimator/explain/rig/effect_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/rig_fit/session_problem.hpp"

namespace diastole::explain {
namespace {

constexpr std::array shown_pressures{&rig::Prediction::cavity_kPa, &rig::Prediction::pump_kPa};

bool is_finite(const rig::Prediction& shown) {
  return std::ranges::all_of(shown_pressures, [&](const auto channel) {
    return std::ranges::all_of(shown.*channel, [](double value) { return std::isfinite(value); });
  });
}

/// Root of the sum of squares over both channels.
double distance_kPa(const rig::Prediction& a, const rig::Prediction& b) {
  double square = 0.0;
  for (const auto channel : shown_pressures)
    for (size_t k = 0; k < (a.*channel).size(); ++k)
      square += std::pow((a.*channel)[k] - (b.*channel)[k], 2);
  return std::sqrt(square);
}

double largest_difference_kPa(const rig::Prediction& a, const rig::Prediction& b) {
  double largest = 0.0;
  for (const auto channel : shown_pressures)
    for (size_t k = 0; k < (a.*channel).size(); ++k)
      largest = std::max(largest, std::abs((a.*channel)[k] - (b.*channel)[k]));
  return largest;
}

}  // namespace

EffectTrial::EffectTrial(const Effect& effect, size_t threads)
    : effect_(effect),
      threads_(threads),
      family_(rig::gel_family()),
      run_(rig::empty_run("baseline", {0.0, "parabolic", 40.0, 1.2, 0.0, 2}, 60.0)),
      neutral_(effect.neutral(rig::RigModel{})) {
  if (effect.change_points() != ChangePoints::none) change_points_ = {{"baseline", 3.1, 63.1}};
  for (const EffectParameter& parameter : effect.parameters())
    typical_.push_back(parameter.typical);
}

rig::Prediction EffectTrial::predicted(const std::optional<std::vector<double>>& values) const {
  rig::RigModel model;
  model.curve = family_.plain();
  model.modulus_kPa = 8.0;
  if (values) effect_.apply(*values, {family_, change_points_}, model);
  return rig::observe(model, rig::simulate_plant(model, run_.drive), run_.drive.place, run_.sample_s);
}

EffectCheck EffectTrial::declared() const {
  EffectCheck check{"declared in full", true, {}};
  const EffectDeclaration& text = effect_.text();
  const auto fail = [&](const std::string& what) {
    check.passed = false;
    check.detail += (check.detail.empty() ? "" : "; ") + what;
  };
  for (const auto& [part, name] : {std::pair{text.title, "title"}, std::pair{text.equations, "equations"},
                                   std::pair{text.source, "source"}, std::pair{text.looks_like, "looks_like"},
                                   std::pair{text.revealed_by, "reveals"}})
    if (part.empty()) fail(fmt::format("no {}", name));
  for (size_t j = 0; j < typical_.size(); ++j) {
    const EffectParameter& parameter = effect_.parameters()[j];
    if (!(parameter.lower <= neutral_[j] && neutral_[j] <= parameter.upper))
      fail(fmt::format("{}: the neutral {:g} is out of bounds", parameter.name, neutral_[j]));
    if (!(parameter.lower < parameter.typical && parameter.typical < parameter.upper))
      fail(fmt::format("{}: the typical {:g} is out of bounds", parameter.name, parameter.typical));
  }
  return check;
}

EffectCheck EffectTrial::neutral() const {
  const rig::Prediction base = predicted({});
  EffectCheck check{"neutral value", true, "the base model exactly"};
  // Sizes alone make it neutral, unless it replaces what the rig has.
  rig::RigModel other;
  other.hose.wave_speed_m_s *= 0.5;
  other.catheter = {0.5 * other.catheter.resonance_Hz, 0.5 * other.catheter.damping};
  std::vector<double> no_size = neutral_;
  if (effect_.neutral(other) == neutral_)
    for (size_t j = 0; j < no_size.size(); ++j)
      if (!is_amplitude(effect_, j)) no_size[j] = typical_[j];
  for (const auto& [values, what] : {std::pair{neutral_, "all parameters neutral"},
                                     std::pair{no_size, "sizes neutral, the others typical"}}) {
    const rig::Prediction same = predicted(values);
    if (same.cavity_kPa == base.cavity_kPa && same.pump_kPa == base.pump_kPa) continue;
    check.passed = false;
    check.detail = is_finite(same) ? fmt::format("{}: pressures differ by {:.3g} kPa", what,
                                                 largest_difference_kPa(same, base))
                                   : fmt::format("{}: no finite pressures", what);
  }
  return check;
}

EffectCheck EffectTrial::shows() const {
  constexpr double least_kPa = 0.005;
  const rig::Prediction typical = predicted(typical_);
  if (!is_finite(typical)) return {"visible", false, "no finite pressures where it is typical"};
  const double largest = largest_difference_kPa(typical, predicted({}));
  return {"visible", largest > least_kPa, fmt::format("{:.3g} kPa where it is typical", largest)};
}

EffectCheck EffectTrial::bounded() const {
  EffectCheck check{"bounded", true, "finite pressures at all bounds"};
  for (size_t j = 0; j < typical_.size(); ++j) {
    const EffectParameter& parameter = effect_.parameters()[j];
    for (const double bound : {parameter.lower, parameter.upper}) {
      std::vector<double> values = typical_;
      values[j] = bound;
      if (is_finite(predicted(values))) continue;
      check.passed = false;
      check.detail = fmt::format("no finite pressures at {} = {:g}", parameter.name, bound);
    }
  }
  return check;
}

EffectCheck EffectTrial::differentiable() const {
  constexpr double wider = 10.0;  // the central difference's step over the fit's
  constexpr double within = 0.05;
  EffectCheck check{"differentiable", true, {}};
  const rig::Prediction here = predicted(typical_);
  double worst = 0.0;
  for (size_t j = 0; j < typical_.size(); ++j) {
    const rig::Unknown unknown = rig::unknown_of(effect_, effect_.parameters()[j]);
    const auto moved = [&](double by) {
      std::vector<double> values = typical_;
      values[j] = unknown.value(unknown.coordinate(typical_[j]) + by);
      return predicted(values);
    };
    const rig::Prediction forward = moved(unknown.perturbation);
    const rig::Prediction up = moved(wider * unknown.perturbation);
    const rig::Prediction down = moved(-wider * unknown.perturbation);
    double difference = 0.0;
    double size = 0.0;
    for (const auto channel : shown_pressures)
      for (size_t k = 0; k < (here.*channel).size(); ++k) {
        const double slope = ((forward.*channel)[k] - (here.*channel)[k]) / unknown.perturbation;
        const double central = ((up.*channel)[k] - (down.*channel)[k]) / (2.0 * wider * unknown.perturbation);
        difference += (slope - central) * (slope - central);
        size += central * central;
      }
    const bool good = std::sqrt(difference) <= within * std::sqrt(size) + 1e-12;
    check.passed = check.passed && good;
    if (size > 0.0) worst = std::max(worst, std::sqrt(difference / size));
    if (!good) check.detail = fmt::format("not by {}", effect_.parameters()[j].name);
  }
  if (check.passed) check.detail = fmt::format("differences agree within {:.2g} %", 100.0 * worst);
  return check;
}

EffectSet EffectTrial::fitted_without(const rig::SessionProblem& problem) const {
  const rig::LinearisedModel base = rig::declared_rig(problem);
  return fit_set_exactly(problem, fit_set(problem, base.at, base, problem.error().prior.share));
}

EffectSet EffectTrial::fitted_with(const rig::SessionProblem& problem) const {
  const rig::LinearisedModel base = rig::declared_rig(problem);
  const std::vector<double> from = effect_.neutral(problem.model(base.at));
  std::optional<EffectSet> best;
  for (const double size : {0.5, 1.0, 2.0}) {
    rig::SessionModel start = base.at;
    start.terms = {{&effect_, {}}};
    if (!change_points_.empty()) start.terms.front().change_points = {{"baseline", 3.1, 3.1}};
    for (size_t j = 0; j < from.size(); ++j) {
      const EffectParameter& parameter = effect_.parameters()[j];
      start.values.push_back(is_amplitude(effect_, j) ? std::clamp(rig::sized_value(parameter, from[j], size),
                                                                   parameter.lower, parameter.upper)
                                                      : parameter.typical);
    }
    EffectSet set = fit_set(problem, start, base, problem.error().prior.share);
    if (!best || set.log_posterior > best->log_posterior) best = std::move(set);
  }
  return fit_set_exactly(problem, *best);
}

EffectCheck EffectTrial::found_again() const {
  constexpr double part = 0.8;  // of the typical size, from which no search starts
  rig::SessionOptions options{.terms = {{&effect_, {}}}, .values = typical_};
  if (!change_points_.empty()) options.terms.front().change_points = {{"baseline", 3.1, 3.1}};
  options.values.front() = neutral_.front() + part * (typical_.front() - neutral_.front());
  const rig::Prediction hidden = predicted(options.values);
  if (!is_finite(hidden)) return {"found again", false, "no finite pressures where it is hidden"};
  const double changed_kPa = distance_kPa(predicted({}), hidden);
  if (changed_kPa == 0.0) return {"found again", false, "changes nothing where it is hidden"};
  const rig::Session session = rig::simulated_session(family_, options);
  const rig::SessionProblem problem(session, family_, threads_);
  const EffectSet found = fitted_with(problem);
  const rig::Prediction shown = predicted(found.model.values);
  if (!is_finite(shown)) return {"found again", false, "no finite pressures where the search ended"};
  const double off = std::abs(found.model.values[0] - options.values[0]);
  const double size = std::abs(options.values[0] - neutral_[0]);
  // What may as well be nothing, or twice as much, is not found.
  const bool is_near =
      off <= 5.0 * found.errors[0] + 0.02 * std::abs(options.values[0]) && found.errors[0] < 0.5 * size;
  // Parameters that these data cannot distinguish may lie anywhere, if together they do what the hidden ones do, or if these
  // data are as likely with them: a bubble that a softer specimen stands for as well.
  const double differs = distance_kPa(shown, hidden) / changed_kPa;
  const bool does_the_same = differs <= 0.1;  // as right as an effect's equations are taken to be
  constexpr double half_a_nat = 0.5;          // decides nothing
  const rig::LinearisedModel base = rig::declared_rig(problem);
  rig::SessionModel truth = base.at;
  truth.terms = options.terms;
  truth.values = options.values;
  const EffectSet at_truth =
      fit_set_exactly(problem, fit_set(problem, truth, base, problem.error().prior.share));
  const bool is_as_likely = found.log_posterior >= at_truth.log_posterior - half_a_nat;
  const std::string_view remark =
      is_near || does_the_same ? ""
      : is_as_likely           ? "; not determined: other parts of the rig do in these data what it does"
                               : "; not found: data are likelier with what was hidden";
  return {"found again",
          (inference::is_settled(found.termination) && (is_near || is_as_likely)) || does_the_same,
          fmt::format("{} {:.4g} as {:.4g} +- {:.2g}, what it changes to {:.1f} %, ln likelihood beside a "
                      "search from there {:+.1f}; {}{}",
                      effect_.parameters()[0].name, options.values[0], found.model.values[0], found.errors[0],
                      100.0 * differs, found.log_posterior - at_truth.log_posterior,
                      inference::sentence(found.termination), remark),
          !is_near && !does_the_same};
}

EffectCheck EffectTrial::silent() const {
  const rig::Session session = rig::simulated_session(family_, {.seed = 7});
  const rig::SessionProblem problem(session, family_, threads_);
  const EffectSet found = fitted_with(problem);
  if (!is_finite(predicted(found.model.values)))
    return {"silent without cause", false, "no finite pressures where the search ended"};
  const double gain = found.log_posterior - fitted_without(problem).log_posterior;
  return {"silent without cause", gain < 0.0, fmt::format("ln odds {:.1f}", gain)};
}

std::vector<EffectCheck> EffectTrial::all(const std::function<void(const std::string&)>& progress) const {
  std::vector<EffectCheck> checks;
  for (const auto& [check, name] :
       {std::pair{&EffectTrial::declared, "the declaration"},
        std::pair{&EffectTrial::neutral, "the neutral value"},
        std::pair{&EffectTrial::shows, "a typical size"}, std::pair{&EffectTrial::bounded, "the bounds"},
        std::pair{&EffectTrial::differentiable, "derivatives"},
        std::pair{&EffectTrial::found_again, "a search in data that have it"},
        std::pair{&EffectTrial::silent, "a search in data that have it not"}}) {
    if (progress) progress(name);
    checks.push_back((this->*check)());
  }
  return checks;
}

}  // namespace diastole::explain
