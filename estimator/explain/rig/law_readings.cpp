#include "estimator/explain/rig/law_readings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <optional>

namespace diastole::explain {
namespace {

/// A curve a * of(x, b), the variable x over the largest one.
struct Form {
  std::string_view name;
  std::string_view
      formula;  ///< with x for the variable, X for the largest, b for the bend, 0 with its unit as zero
  bool bends;
  double (*of)(double x, double b);
};

/// The simplest first.
constexpr std::array forms{
    Form{"constant", "a", false, [](double, double) { return 1.0; }},
    Form{"linear", "a * x / X", false, [](double x, double) { return x; }},
    Form{"square", "a * x * abs(x) / X^2", false, [](double x, double) { return x * std::abs(x); }},
    Form{"one-sided-up", "a * max(x, zero) / X", false, [](double x, double) { return std::max(x, 0.0); }},
    Form{"one-sided-down", "a * min(x, zero) / X", false, [](double x, double) { return std::min(x, 0.0); }},
    Form{"square-up", "a * max(x, zero)^2 / X^2", false,
         [](double x, double) { return std::pow(std::max(x, 0.0), 2); }},
    Form{"square-down", "-a * min(x, zero)^2 / X^2", false,
         [](double x, double) { return -std::pow(std::min(x, 0.0), 2); }},
    Form{"saturating", "a * tanh(x / b)", true, [](double x, double b) { return std::tanh(x / b); }},
    Form{"up-to", "a * min(x, b) / b", true, [](double x, double b) { return std::min(x, b) / b; }},
    Form{"beyond", "a * (max(x - b, zero) - max(-x - b, zero)) / X", true,
         [](double x, double b) { return std::max(x - b, 0.0) - std::max(-x - b, 0.0); }}};

struct FoundForm {
  const Form* form;
  double a, b;
};

double farthest(const LearnedTerm& term) {
  return std::max(std::abs(term.curve.front()[0]), std::abs(term.curve.back()[0]));
}

/// The best a of a form with this bend; nothing if the data do not bear it.
std::optional<FoundForm> borne(const Form& form, double b, const CurveEvidence& evidence,
                               const LearnedTerm& term) {
  constexpr double true_curves = 0.9;
  const double X = farthest(term);
  const auto knots = static_cast<Eigen::Index>(term.curve.size());
  Eigen::VectorXd curve(knots), shape(knots);
  for (Eigen::Index k = 0; k < knots; ++k) {
    curve[k] = term.curve[static_cast<size_t>(k)][1];
    shape[k] = form.of(term.curve[static_cast<size_t>(k)][0] / X, b);
  }
  const auto chi_square = [&](const Eigen::VectorXd& values) {
    return values.dot(evidence.precision * values) - 2.0 * values.dot(evidence.slope);
  };
  const double square = shape.dot(evidence.precision * shape);
  if (!(square > 0.0)) return {};
  const FoundForm found{&form, shape.dot(evidence.slope) / square, b};
  for (Eigen::Index k = 0; k < knots; ++k) {
    const auto& [lower, upper] = term.band[static_cast<size_t>(k)];
    const double rounding = 1e-6 * std::abs(found.a);
    const double value =
        evidence.precision(k, k) > 0.0 ? found.a * shape[k] : 0.0;  // 0 at rest, where all are nothing
    if (value < lower - rounding || value > upper + rounding) return {};
  }
  const auto free = static_cast<double>((evidence.precision.diagonal().array() > 0.0).count());
  if (chi_square(found.a * shape) - chi_square(curve) >
      boost::math::quantile(boost::math::chi_squared(free), true_curves))
    return {};
  return found;
}

std::optional<FoundForm> simplest_form(const PortLaw& law, const CurveEvidence& evidence,
                                       const LearnedTerm& term) {
  constexpr int bends = 20;
  if (law.shape == CurveShape::periodic) return {};
  const bool two_sided = term.curve.front()[0] < 0.0 && term.curve.back()[0] > 0.0;
  for (const Form& form : forms) {
    if (form.name == "constant" && law.shape != CurveShape::resisting) continue;
    if (!two_sided &&
        (form.name.starts_with("one-sided") || form.name.ends_with("-up") || form.name.ends_with("-down")))
      continue;
    if (form.name == "up-to" && two_sided) continue;
    std::vector<FoundForm> admitted;
    for (int i = 1; i < (form.bends ? bends : 2); ++i)
      if (const auto found = borne(form, static_cast<double>(i) / bends, evidence, term))
        admitted.push_back(*found);
    if (!admitted.empty()) return admitted[admitted.size() / 2];
  }
  return {};
}

std::string replaced(std::string text, std::string_view word, const std::string& by) {
  for (size_t at = 0; (at = text.find(word, at)) != std::string::npos;) {
    const auto is_letter = [&](size_t i) { return i < text.size() && std::isalnum(text[i]) != 0; };
    if (is_letter(at + word.size()) || (at > 0 && is_letter(at - 1))) {
      at += word.size();
      continue;
    }
    text.replace(at, word.size(), by);
    at += by.size();
  }
  return text;
}

std::string with_unit(double value, std::string_view unit) {
  return unit == "1" ? fmt::format("{:.5g}", value) : fmt::format("{:.5g} [{}]", value, unit);
}

/// Of what shape, in words.
std::string shape_words(const PortLaw& law, const FoundForm& found, double X) {
  const std::string bend = fmt::format("{:.3g} {}", found.b * X, law.of_unit == "1" ? "" : law.of_unit);
  if (found.form->name == "constant") return "the same at all of " + std::string(law.of);
  if (found.form->name == "linear") return fmt::format("in proportion to {}", law.of);
  if (found.form->name == "square") return fmt::format("as the square of {}, with its sign", law.of);
  if (found.form->name == "saturating") return fmt::format("odd in {}, saturating beyond {}", law.of, bend);
  if (found.form->name == "up-to") return fmt::format("grows up to {} of {} and stays", bend, law.of);
  if (found.form->name == "beyond")
    return fmt::format("nothing below {} of {}, growing beyond", bend, law.of);
  return fmt::format("in one direction of {} only", law.of);
}

/// What does so, as far as it is known.
std::string likeness(const PortLaw& law, std::string_view form) {
  const bool one_sided = form.ends_with("-up") || form.ends_with("-down");
  if (law.sets == "p_pump" && law.of == "q_hose") {
    if (one_sided) return "a valve or flap that closes in one direction";
    if (form == "square") return "a constriction or a turn; see hose-loss-excess";
    if (form == "linear") return "a narrow passage with laminar flow";
    if (form == "saturating") return "dry friction: something that has to be pushed";
    return "something on the way into the hose that takes pressure";
  }
  if (law.shape == CurveShape::resisting)
    return form == "constant"
               ? "a constriction; see hose-loss-excess"
               : "a hose that narrows with what it holds or with its pressure: a kink, air in a bend";
  if (law.sets == "q_hose") {
    if (form == "linear") return "a leak past the seal; see seal-leak-pump";
    if (form == "beyond")
      return "something that slips or opens beyond a pressure: a coupling, a relief valve";
    return "a leak past the seal that grows with the pressure";
  }
  if (law.sets == "q_cavity") return "a leak at the cavity; see cannula-leak-cavity";
  if (law.sets == "V_piston")
    return law.of == "V_command"
               ? "a screw or a piston whose volume is not in proportion; see stroke-gain, backlash"
               : "a motor that lags the faster it runs; see trigger-delay";
  if (law.sets == "p_seen") {
    if (law.of == "phase") return "something that is picked up in step with the cycle";
    if (law.of == "t") return "a sensor that drifts; see sensor-drift";
    return "a sensor that is not straight; see sensor-gain";
  }
  if (law.of == "dV")
    return form == "linear" ? "viscous friction; see viscoelasticity" : "dry friction, hysteresis";
  if (law.of == "cycle") return "a specimen that ages; see stress-softening, temperature-drift";
  if (form == "up-to") return "something that the specimen rests on while it is small: contact";
  if (form == "beyond") return "something that the specimen meets when it is large: contact";
  return "another law of the specimen; see strain-stiffening, chamber-back-pressure";
}

/// How a curve without a formula runs.
std::string run_of(const LearnedTerm& term, std::string_view of) {
  const auto& largest =
      *std::ranges::max_element(term.curve, {}, [](const auto& at) { return std::abs(at[1]); });
  return fmt::format("largest at {:.3g} of {}, {:+.3g} {}", largest[0], of, largest[1],
                     term.unit == "1" ? "" : term.unit);
}

}  // namespace

void read_law(const PortLaw& law, const CurveEvidence& evidence, LearnedTerm& term, LawText text) {
  const std::optional<FoundForm> found = simplest_form(law, evidence, term);
  text.title = fmt::format("learnt: {} by {}", law.sets, law.of);
  if (!found) {
    term.readings = {fmt::format("{}: perhaps {}", run_of(term, law.of), likeness(law, ""))};
  } else {
    term.readings = {fmt::format("{}: looks like {}", shape_words(law, *found, farthest(term)),
                                 likeness(law, found->form->name))};
  }
  text.looks_like = term.readings.front();
  text.reveals = "A waveform on which its band is wide: one that reaches the variable's ends more slowly.";
  if (!found) {
    std::vector<double> at, values;
    for (const auto& [x, y] : term.curve) {
      at.push_back(x);
      values.push_back(y);
    }
    term.toml = tabulated_law(law, at, values, text);
    return;
  }
  const double X = farthest(term);
  std::string formula(found->form->formula);
  formula = replaced(formula, "x", std::string(law.of));
  formula = replaced(formula, "X", with_unit(X, law.of_unit));
  formula = replaced(formula, "zero", with_unit(0.0, law.of_unit));
  constexpr double widest = 5.0;  // times what was found
  std::vector<CurveParameter> parameters{{"a", std::string(law.unit), 0.0, std::min(0.0, widest * found->a),
                                          std::max(0.0, widest * found->a), found->a, "size of the curve"}};
  if (found->form->bends)
    parameters.push_back(
        {"b", std::string(law.of_unit), found->b * X, 0.02 * X, X, found->b * X, "where it bends"});
  term.closed_form = formula;
  for (const CurveParameter& parameter : parameters)
    term.closed_form +=
        fmt::format(", {} = {}", parameter.name, with_unit(parameter.typical, parameter.unit));
  term.toml = formula_law(law, law.behind.empty() ? formula : "(" + formula + ")", parameters, text);
}

}  // namespace diastole::explain
