#pragma once
// The laws that may be missing at a port of the rig, each with one unknown curve: where a learned term (learned_term.hpp) is
// looked for. A law with a curve is an effect file (docs/effects-as-files.md), and nothing else: what is fitted is what a
// user gets.
//
//   drive      p_pump + law(q_hose)              what the fluid loses on its way into the hose
//              p_pump + law(V) q_hose |q_hose|   the same where it depends on how full the specimen is
//              q_piston - law(p_pump)            a leak past the seal
//              V_command + law(V_command), law(q_command)
//   specimen   p + law(V), p + law(dV), p + p law(cycle); q_hose - law(p_cavity), a leak
//   sensor     p + law(p), p + law(phase), p + law(t)

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/rig_fit/session_problem.hpp"

namespace diastole::explain {

/// What physics demands of a curve beside smoothness.
enum class CurveShape {
  free,       ///< nothing at rest
  passive,    ///< nothing at rest, and the more the further from it: what it does takes energy
  resisting,  ///< a loss coefficient: nowhere negative
  periodic    ///< nothing at rest, to which it returns at its end
};

struct PortLaw {
  Port port;
  std::string_view sets;    ///< "p_pump"
  std::string_view before;  ///< of the formula, before and behind the curve: "p_pump + "
  std::string_view of;      ///< what the curve depends on: "q_hose"
  std::string_view behind;
  std::string_view of_unit, unit;  ///< of the curve's argument and value
  CurveShape shape;
  std::vector<std::string> variables;  ///< on which the law depends, the curve's first
};
std::span<const PortLaw> port_laws();
/// Whether these recordings could show it.
bool is_seen(const PortLaw& law, const rig::SessionProblem& problem);

/// Lowest and highest of each variable in the session, but for a five hundredth of the time each.
using VariableRanges = std::map<std::string_view, std::array<double, 2>>;
VariableRanges variable_ranges(const rig::SessionProblem& problem, const rig::SessionModel& model);

/// Evenly from rest to the end of the range, on each side that the variable reaches: about ten intervals. Rest is one.
std::vector<double> curve_knots(std::array<double, 2> range);
/// A value of the curve that would be as large as what the session shows.
double curve_scale(const PortLaw& law, const rig::SessionProblem& problem, const VariableRanges& ranges);

/// Texts of a file.
struct LawText {
  std::string id = "learned";
  std::string title = "a law that was learnt";
  std::string source = "learnt from recordings", looks_like = "", reveals = "";
  std::vector<std::string> learnt_from = {}, looks_alike = {};  ///< run_ids; ids of other effects
};
/// A file with the tabulated curve times a size that is 0 or 1: the natural cubic spline, straight beyond its ends.
std::string tabulated_law(const PortLaw& law, std::span<const double> at, std::span<const double> values,
                          const LawText& text = {});
/// A parameter of a file whose curve is a formula.
struct CurveParameter {
  std::string name, unit;
  double neutral = 0.0, lower = 0.0, upper = 0.0, typical = 0.0;
  std::string meaning;
};
/// A file whose curve is a formula of its parameters.
std::string formula_law(const PortLaw& law, const std::string& curve,
                        std::span<const CurveParameter> parameters, const LawText& text);
std::shared_ptr<const Effect> effect_of_text(const std::string& text);

}  // namespace diastole::explain
