#include "estimator/explain/rig/port_law.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "estimator/effect_files/effect_file.hpp"
#include "estimator/effects/file_effect.hpp"
#include "estimator/rig/simulation.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::explain {
namespace {

using enum CurveShape;

std::string parameter_text(const CurveParameter& parameter) {
  return fmt::format(
      "[[parameter]]\nname = {}\nunit = {}\nneutral = {:g}\nbounds = [{:g}, {:g}]\ntypical = {:g}\n"
      "meaning = {}\n\n",
      toml_text(parameter.name), toml_text(parameter.unit), parameter.neutral, parameter.lower,
      parameter.upper, parameter.typical, toml_text(parameter.meaning));
}

std::string list_text(std::string_view key, const std::vector<std::string>& texts) {
  if (texts.empty()) return {};
  std::string list;
  for (const std::string& text : texts)
    list += (list.empty() ? "" : ", ") + toml_text(text);
  return fmt::format("{} = [{}]\n", key, list);
}

std::string file_text(const PortLaw& law, const std::string& inner, const std::string& curve,
                      const LawText& text) {
  return fmt::format(
      "format = \"diastole-effect\"\nversion = 1\nid = {}\ntitle = {}\nport = {}\n{}\n{}"
      "[equations]\n{} = {}\n\n[text]\nsource = {}\nlooks_like = {}\nreveals = {}\n{}",
      toml_text(text.id), toml_text(text.title), toml_text(name_of(law.port)),
      list_text("learnt_from", text.learnt_from), inner, law.sets,
      toml_text(fmt::format("{}{}{}", law.before, curve, law.behind)), toml_text(text.source),
      toml_text(text.looks_like), toml_text(text.reveals), list_text("looks_alike", text.looks_alike));
}

}  // namespace

std::span<const PortLaw> port_laws() {
  static const std::vector<PortLaw> list{
      {Port::drive, "p_pump", "p_pump + ", "q_hose", "", "mL/s", "kPa", passive, {"q_hose"}},
      {Port::drive,
       "p_pump",
       "p_pump + ",
       "V",
       " * q_hose * abs(q_hose)",
       "mL",
       "kPa s^2/mL^2",
       resisting,
       {"V", "q_hose"}},
      {Port::drive, "q_hose", "q_piston - ", "p_pump", "", "kPa", "mL/s", passive, {"p_pump"}},
      {Port::drive, "V_piston", "V_command + ", "V_command", "", "mL", "mL", free, {"V_command"}},
      {Port::drive, "V_piston", "V_command + ", "q_command", "", "mL/s", "mL", free, {"q_command"}},
      {Port::specimen, "p", "p + ", "V", "", "mL", "kPa", free, {"V"}},
      {Port::specimen, "p", "p + ", "dV", "", "mL/s", "kPa", passive, {"dV"}},
      {Port::specimen, "p", "p + p * ", "cycle", "", "1", "1", free, {"cycle", "p"}},
      {Port::specimen, "q_cavity", "q_hose - ", "p_cavity", "", "kPa", "mL/s", passive, {"p_cavity"}},
      {Port::sensor, "p_seen", "p + ", "p", "", "kPa", "kPa", free, {"p"}},
      {Port::sensor, "p_seen", "p + ", "phase", "", "1", "kPa", periodic, {"phase"}},
      {Port::sensor, "p_seen", "p + ", "t", "", "s", "kPa", free, {"t"}}};
  return list;
}

bool is_seen(const PortLaw& law, const rig::SessionProblem& problem) {
  return law.sets != "p_pump" || problem.noise().channels.contains(rig::Channel::pump);
}

VariableRanges variable_ranges(const rig::SessionProblem& problem, const rig::SessionModel& at) {
  constexpr double step_s = 1.0 / 150.0;
  const rig::RigModel model = problem.model(at);
  std::map<std::string_view, std::vector<double>> values;
  double cycles = 0.0;
  double longest_s = 0.0;
  for (const rig::SessionRun& run : problem.session().runs) {
    const rig::DriveTrace motion = rig::sampled_motion(run.drive, step_s);
    const rig::PlantTrace plant = rig::simulate_plant(model, run.drive, motion, {.step_s = step_s});
    const auto add = [&](std::string_view name, const std::vector<double>& more) {
      values[name].insert(values[name].end(), more.begin(), more.end());
    };
    add("V", plant.cavity_mL);
    add("V_command", motion.volume_mL);
    add("q_command", motion.flow_mL_per_s);
    add("q_hose", motion.flow_mL_per_s);
    add("dV", motion.flow_mL_per_s);
    add("p", plant.cavity_kPa);
    add("p_cavity", plant.cavity_kPa);
    add("p_pump", plant.pump_kPa);
    cycles += static_cast<double>(run.drive.place.trigger_s.size());
    longest_s = std::max(longest_s, run.drive.end_s);
  }
  VariableRanges ranges{{"phase", {0.0, 1.0}}, {"cycle", {0.0, cycles}}, {"t", {0.0, longest_s}}};
  for (auto& [name, list] : values) {
    const size_t trimmed = list.size() / 500;
    std::ranges::sort(list);
    ranges[name] = {list[trimmed], list[list.size() - 1 - trimmed]};
  }
  return ranges;
}

std::vector<double> curve_knots(std::array<double, 2> range) {
  constexpr double intervals = 10.0;
  constexpr double reached = 0.1;  // of the farther side: less is overshoot about rest
  const auto [lower, upper] = range;
  const double farther = std::max(upper, -lower);
  const double below = -lower > reached * farther ? -lower : 0.0;
  const double above = upper > reached * farther ? upper : 0.0;
  const double step = (below + above) / intervals;
  std::vector<double> knots;
  const auto add_side = [&](double reach, double sign) {
    const double count = std::max(std::round(reach / step), 2.0);
    for (double k = 1.0; reach > 0.0 && k <= count; ++k)
      knots.push_back(sign * reach * k / count);
  };
  add_side(below, -1.0);
  knots.push_back(0.0);
  add_side(above, 1.0);
  std::ranges::sort(knots);
  return knots;
}

double curve_scale(const PortLaw& law, const rig::SessionProblem& problem, const VariableRanges& ranges) {
  const auto farther = [&](std::string_view name) {
    const auto [lower, upper] = ranges.at(name);
    return std::max(upper, -lower);
  };
  const auto range = [&](rig::Signal signal) { return problem.error().range[static_cast<size_t>(signal)]; };
  if (law.unit == "1") return 1.0;
  if (law.unit == "mL") return farther("V_command");
  if (law.unit == "mL/s") return farther("q_command");
  if (law.shape == resisting) return range(rig::Signal::pump) / std::pow(farther("q_hose"), 2);
  return range(law.sets == "p_pump" ? rig::Signal::pump : rig::Signal::cavity);
}

std::string tabulated_law(const PortLaw& law, std::span<const double> at, std::span<const double> values,
                          const LawText& text) {
  const CurveParameter size{"size", "1", 0.0, 0.0, 3.0, 1.0, "part of the curve"};
  const std::string curve =
      fmt::format("[[curve]]\nname = \"law\"\nof = {}\nunit = {}\nat = [{}]\nvalues = [{}]\n\n",
                  toml_text(law.of_unit), toml_text(law.unit), fmt::join(at, ", "), fmt::join(values, ", "));
  return file_text(law, parameter_text(size) + curve, fmt::format("size * law({})", law.of), text);
}

std::string formula_law(const PortLaw& law, const std::string& curve,
                        std::span<const CurveParameter> parameters, const LawText& text) {
  std::string inner;
  for (const CurveParameter& parameter : parameters)
    inner += parameter_text(parameter);
  return file_text(law, inner, curve, text);
}

std::shared_ptr<const Effect> effect_of_text(const std::string& text) {
  return make_file_effect(effect_files::read_effect_text(text, "learned.effect.toml"));
}

}  // namespace diastole::explain
