#include "estimator/effect_files/effect_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimator/expressions/curve.hpp"
#include "estimator/expressions/formula.hpp"
#include "estimator/expressions/program.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::effect_files {
namespace {

using expressions::NodeId;
using expressions::Scope;
using expressions::Unit;

constexpr std::string_view unit_remedy =
    "Write products and quotients of m, mm, s, kg, K, Hz, L, mL, kPa, Pa, N, J, 1, %, ppm, deg, cycle: "
    "\"mL/(s kPa)\".";

Unit known_unit(std::string_view text) { return *expressions::parse_unit(text); }

Unit read_unit(TableReader& table, std::string_view key) {
  const std::string text = table.text(key);
  const auto unit = expressions::parse_unit(text);
  if (!unit) table.fail(key, fmt::format("\"{}\" is no unit that is known", text), std::string(unit_remedy));
  return *unit;
}

const In* constant_named(std::string_view name) {
  static const std::vector<In> constants = [] {
    std::vector<In> list;
    for (size_t i = index_of(first_constant); i < quantity_count; ++i)
      list.push_back(static_cast<In>(i));
    return list;
  }();
  const auto found = std::ranges::find(constants, name, [](In in) { return quantities[index_of(in)].name; });
  return found == constants.end() ? nullptr : &*found;
}

std::optional<Out> law_named(std::string_view name) {
  const auto* found = std::ranges::find(laws, name, &LawText::name);
  if (found == laws.end()) return {};
  return static_cast<Out>(found - laws.begin());
}

/// Times and constants are known at every port.
bool is_known_at(In in, std::string_view port) {
  return in < In::V_command || in >= first_constant || std::ranges::any_of(laws, [&](const LawText& law) {
           return law.port == port && std::ranges::count(law.inputs, in) > 0;
         });
}

/// A formula that a rig's simulation asks.
struct Asked {
  PlacedText text;
  NodeId node;
};

class Reader {
 public:
  explicit Reader(TableReader root) : root_(std::move(root)) {}

  EffectFile read() {
    root_.expect_format("diastole-effect", 1);
    effect_.file = root_.file();
    read_heading();
    std::vector<TableReader> parameters = root_.tables("parameter");
    for (TableReader& table : parameters)
      read_parameter(table);
    if (effect_.parameters.empty())
      root_.fail(
          "parameter", "the effect has no parameter",
          "Add one [[parameter]] or more; the first is the effect's size, nothing at its neutral value.");
    for (TableReader& table : root_.tables("curve"))
      read_curve(table);
    std::vector<TableReader> states = root_.tables("state");
    for (TableReader& table : states)
      announce_state(table);
    TableReader equations = root_.table("equations");
    for (const auto& [name, text] : equations.named_texts())
      read_equation(equations, name, text);
    for (size_t i = 0; i < states.size(); ++i)
      read_state(states[i], i);
    equations.finish();
    if (effect_.laws.empty() && effect_.constants.empty())
      equations.fail("", "sets nothing of the rig", fmt::format("Write one of {}.", settable()));
    require_use(parameters);
    require_finite();
    if (!effect_.laws.empty())
      make_of_formula(law_text_.file, law_text_.place(0),
                      [&] { require_form(effect_.laws.front().sets, effect_.laws.front().node, law_text_); });
    read_text();
    root_.finish();
    return std::move(effect_);
  }

 private:
  void read_heading() {
    effect_.id = expressions::read_id(root_);
    effect_.title = root_.text("title");
    effect_.port = root_.choice("port", {"drive", "specimen", "sensor", "clock"});
    effect_.keeps_modulus = root_.flag_or("keeps_modulus", true);
    if (root_.has("changes")) effect_.changes = root_.choice("changes", {"hose", "drive", "catheter"});
    effect_.learnt_from = root_.texts_or("learnt_from", {});
    if (root_.has("change_points"))
      effect_.change_points = root_.choice("change_points", {"none", "one", "several"});
    for (size_t i = 0; i < quantity_count; ++i) {
      const auto in = static_cast<In>(i);
      if (quantities[i].name.empty() || (in == In::t_since && effect_.change_points == "none")) continue;
      if (!is_known_at(in, effect_.port)) continue;
      scope_.names[std::string(quantities[i].name)] = {effect_.graph.input(i),
                                                       known_unit(quantities[i].unit)};
    }
  }

  /// Of a quantity too that this port does not know.
  [[nodiscard]] bool has_meaning(const std::string& name) const {
    return scope_.names.contains(name) || scope_.curves.contains(name) ||
           std::ranges::count(quantities, name, &QuantityText::name) > 0;
  }

  /// A name that the file brings along.
  std::string read_name(TableReader& table) {
    const std::string name = table.text("name");
    if (!expressions::is_name(name))
      table.fail("name", fmt::format("\"{}\" cannot be a name in formulas", name),
                 "Write letters, digits and _, beginning with a letter, that are not a function's name.");
    if (has_meaning(name) || law_named(name))
      table.fail("name", fmt::format("\"{}\" has a meaning already", name), "Choose another name.");
    return name;
  }

  void read_parameter(TableReader& table) {
    FileParameter parameter;
    parameter.name = read_name(table);
    if (parameter.unit = table.text_or("unit", ""); parameter.unit == "1") parameter.unit.clear();
    parameter.measured_in = table.has("unit") ? read_unit(table, "unit") : Unit{};
    parameter.meaning = table.text_or("meaning", "");
    if (table.has("scale"))
      parameter.scale = table.choice("scale", {"linear", "logarithmic", "inverse-square"});
    const std::vector<double> bounds = table.numbers("bounds", 2);
    parameter.lower = bounds[0];
    parameter.upper = bounds[1];
    if (!(parameter.lower < parameter.upper))
      table.fail("bounds", fmt::format("[{}, {}] is not an interval", bounds[0], bounds[1]),
                 "Write [lower, upper] with lower < upper.");
    const bool is_linear = parameter.scale == "linear";
    if (!is_linear && !(parameter.lower > 0.0))
      table.fail("bounds", fmt::format("begin at {}, but the scale is {}", parameter.lower, parameter.scale),
                 "Only positive numbers have such a scale.");
    read_neutral(table, parameter);
    const double farther = parameter.upper - parameter.neutral >= parameter.neutral - parameter.lower
                               ? parameter.upper
                               : parameter.lower;
    parameter.typical = is_linear ? parameter.neutral + 0.1 * (farther - parameter.neutral)
                                  : parameter.neutral * std::pow(farther / parameter.neutral, 0.5);
    if (table.has("typical"))
      parameter.typical = table.number("typical", {.above = parameter.lower, .below = parameter.upper});
    table.finish();
    scope_.names[parameter.name] = {effect_.graph.input(quantity_count + effect_.parameters.size()),
                                    parameter.measured_in};
    effect_.parameters.push_back(std::move(parameter));
  }

  /// A number, or one of the rig's constants: what the rig has.
  void read_neutral(TableReader& table, FileParameter& parameter) {
    if (!table.has_text("neutral")) {
      parameter.neutral = table.number("neutral", {.at_least = parameter.lower, .at_most = parameter.upper});
      return;
    }
    const std::string name = table.text("neutral");
    const In* constant = constant_named(name);
    if (constant == nullptr)
      table.fail(
          "neutral", fmt::format("\"{}\" is neither a number nor a constant of the rig", name),
          "Write the value that changes nothing, or the name of what the parameter replaces, as \"c_hose\".");
    const QuantityText& quantity = quantities[index_of(*constant)];
    if (const Unit unit = known_unit(quantity.unit);
        !unit.same_dimension(parameter.measured_in) ||
        expressions::factor_between(unit, parameter.measured_in) != 1.0)
      table.fail("neutral",
                 fmt::format("{} is in {}, the parameter in {}", name, quantity.unit,
                             parameter.unit.empty() ? "1" : parameter.unit),
                 "Give the parameter that unit.");
    parameter.neutral_constant = *constant;
    parameter.neutral = quantity.usual;
    if (parameter.neutral < parameter.lower || parameter.neutral > parameter.upper)
      table.fail("neutral",
                 fmt::format("{} is {:g} in the rig that effects are tried in, outside [{}, {}]", name,
                             parameter.neutral, parameter.lower, parameter.upper),
                 "Widen the bounds: with the neutral value nothing changes.");
  }

  void read_curve(TableReader& table) {
    const std::string name = read_name(table);
    const Unit of = read_unit(table, "of");
    const Unit unit = read_unit(table, "unit");
    const std::vector<double> at = table.numbers("at");
    const std::vector<double> values = table.numbers("values", at.size());
    constexpr size_t most = 64;
    if (at.size() < 2 || at.size() > most || std::ranges::adjacent_find(at, std::greater_equal()) != at.end())
      table.fail("at", fmt::format("are not from 2 to {} numbers that rise", most), "Correct the table.");
    table.finish();
    scope_.curves[name] = expressions::tabulated_curve(at, values, of, unit);
  }

  void announce_state(TableReader& table) {
    FileState state{.name = read_name(table)};
    state_units_.push_back(read_unit(table, "unit"));
    scope_.names[state.name] = {
        effect_.graph.input(quantity_count + effect_.parameters.size() + effect_.states.size()),
        state_units_.back()};
    effect_.states.push_back(std::move(state));
  }

  void read_state(TableReader& table, size_t i) {
    FileState& state = effect_.states[i];
    const PlacedText rate = table.placed_text("rate");
    state.place = rate.place(0);
    state.rate = expressions::parse_formula_in(rate, scope_, effect_.graph, state_units_[i] / known_unit("s"),
                                               "the rate of " + state.name);
    state.initial = effect_.graph.number(0.0);
    if (table.has("initial")) {
      if (!table.has_text("initial")) {
        state.initial = effect_.graph.number(table.number("initial"));
      } else {
        const PlacedText initial = table.placed_text("initial");
        state.initial =
            expressions::parse_formula_in(initial, scope_, effect_.graph, state_units_[i], state.name);
        for (size_t k = 0; k < effect_.states.size(); ++k)
          if (effect_.graph.depends_on(state.initial, effect_.input_of_state(k)))
            fail(initial, fmt::format("depends on the state {}", effect_.states[k].name),
                 "A state begins at what parameters and the rig say.");
        formulas_ += initial.text + ";";
        asked_.push_back({initial, state.initial});
      }
    }
    table.finish();
    if (effect_.laws.empty() || effect_.laws.front().sets == Out::t_seen ||
        effect_.laws.front().sets == Out::q_hose || effect_.laws.front().sets == Out::p_pump ||
        effect_.laws.front().sets == Out::q_cavity)
      table.fail("name", "states belong to an effect that sets V_piston, p or p_seen",
                 "Set one of these, or write the effect without states.");
    require_inputs(effect_.laws.front().sets, state.rate, rate);
    formulas_ += rate.text + ";";
    asked_.push_back({rate, state.rate});
    effect_.equations += fmt::format("; d{}/dt = {}", state.name, rate.text);
  }

  void read_equation(TableReader& table, const std::string& name, const PlacedText& text) {
    if (!effect_.equations.empty()) effect_.equations += "; ";
    effect_.equations += fmt::format("{} = {}", name, text.text);
    formulas_ += text.text + ";";
    if (const auto law = law_named(name)) {
      const LawText& about = laws[static_cast<size_t>(*law)];
      require_port(table, name, about.port);
      if (!effect_.laws.empty())
        table.fail(name,
                   fmt::format("stands beside {}", laws[static_cast<size_t>(effect_.laws.front().sets)].name),
                   "An effect sets one of them; write the other one into a file of its own.");
      const NodeId node =
          expressions::parse_formula_in(text, scope_, effect_.graph, known_unit(about.unit), name);
      require_inputs(*law, node, text);
      effect_.laws.push_back({*law, node, text.place(0)});
      asked_.push_back({text, node});
      law_text_ = text;
    } else if (const In* constant = constant_named(name)) {
      require_port(table, name, port_of(*constant));
      const NodeId node = expressions::parse_formula_in(
          text, scope_, effect_.graph, known_unit(quantities[index_of(*constant)].unit), name);
      for (size_t i = 0; i < effect_.inputs(); ++i) {
        const bool may = i >= index_of(first_constant) && i < quantity_count + effect_.parameters.size();
        if (!may && effect_.graph.depends_on(node, i))
          fail(text, fmt::format("{} is a constant of the rig, but depends on {}", name, name_of_input(i)),
               "Make it of parameters and other constants.");
      }
      effect_.constants.push_back({*constant, node, text.place(0)});
      asked_.push_back({text, node});
    } else {
      if (!expressions::is_name(name) || has_meaning(name))
        table.fail(name, "has a meaning already and cannot be set",
                   fmt::format("Write one of {}.", settable()));
      scope_.names[name] = expressions::parse_formula(text, scope_, effect_.graph);
    }
  }

  [[nodiscard]] std::string name_of_input(size_t i) const {
    if (i < quantity_count) return std::string(quantities[i].name);
    const size_t k = i - quantity_count;
    return k < effect_.parameters.size() ? effect_.parameters[k].name
                                         : effect_.states[k - effect_.parameters.size()].name;
  }
  /// Behind a number; nothing for pure numbers and states.
  [[nodiscard]] std::string unit_of_input(size_t i) const {
    const size_t parameter = i - quantity_count;
    const std::string unit = i < quantity_count                      ? std::string(quantities[i].unit)
                             : parameter < effect_.parameters.size() ? effect_.parameters[parameter].unit
                                                                     : "";
    return unit.empty() || unit == "1" ? "" : " " + unit;
  }
  static std::string settable() {
    std::string list;
    for (const LawText& law : laws)
      list += fmt::format("{} ({}), ", law.name, law.port);
    return list + "or a constant of the rig, as c_hose or pump_gas";
  }
  void require_port(TableReader& table, const std::string& name, std::string_view port) const {
    if (effect_.port != port)
      table.fail(name, fmt::format("is at the port {}, but the effect's is {}", port, effect_.port),
                 "Correct port, or write an effect for each of them.");
  }
  [[noreturn]] static void fail(const PlacedText& text, std::string problem, std::string remedy) {
    throw InputError({text.file, text.place(0), std::move(problem), std::move(remedy)});
  }

  void require_inputs(Out law, NodeId node, const PlacedText& text) const {
    const LawText& about = laws[static_cast<size_t>(law)];
    for (size_t i = index_of(In::V_command); i < index_of(first_constant); ++i) {
      if (std::ranges::count(about.inputs, static_cast<In>(i)) > 0 || !effect_.graph.depends_on(node, i))
        continue;
      std::string known = "t, t_session, phase, cycle";
      for (const In in : about.inputs)
        known += fmt::format(", {}", quantities[index_of(in)].name);
      fail(text, fmt::format("{} is not known where {} is made", quantities[i].name, about.name),
           fmt::format("Known there: {}, the rig's constants, parameters and states.", known));
    }
  }
  /// A leak takes from the flow; a clock runs evenly.
  void require_form(Out law, NodeId node, const PlacedText& text) {
    const auto require_slope = [&](In in, std::string_view what) {
      const NodeId slope = effect_.graph.derivative(node, index_of(in));
      if (!effect_.graph.is_number(slope, 1.0))
        fail(text, "is not " + std::string(what), "Correct the formula.");
    };
    if (law == Out::q_hose) require_slope(In::q_piston, "q_piston less something");
    if (law == Out::p_pump) require_slope(In::p_pump, "p_pump and something");
    if (law == Out::q_cavity) require_slope(In::q_hose, "q_hose less something");
    if (law != Out::t_seen) return;
    const NodeId rate = effect_.graph.derivative(node, index_of(In::t));
    for (size_t i = 0; i < index_of(first_constant); ++i)
      if (effect_.graph.depends_on(rate, i) ||
          (static_cast<In>(i) != In::t && effect_.graph.depends_on(node, i)))
        fail(text, "is not a constant and a multiple of t", "Write for example t - delay or t * (1 + skew).");
  }

  void require_use(const std::vector<TableReader>& parameters) const {
    for (size_t i = 0; i < parameters.size(); ++i)
      if (!expressions::mentions(formulas_, effect_.parameters[i].name))
        parameters[i].fail("name", fmt::format("no formula uses {}", effect_.parameters[i].name),
                           "Remove the parameter, or use it in an equation.");
  }

  /// All neutral, all typical, and each at either bound beside typical ones.
  [[nodiscard]] std::vector<std::vector<double>> tried_values() const {
    std::vector<std::vector<double>> tried(2);
    for (const FileParameter& parameter : effect_.parameters) {
      tried[0].push_back(parameter.neutral);
      tried[1].push_back(parameter.typical);
    }
    for (size_t i = 0; i < effect_.parameters.size(); ++i)
      for (const double bound : {effect_.parameters[i].lower, effect_.parameters[i].upper}) {
        std::vector<double> values = tried[1];
        values[i] = bound;
        tried.push_back(std::move(values));
      }
    return tried;
  }

  [[nodiscard]] expressions::Program program(NodeId node) const { return {effect_.graph, std::vector{node}}; }

  /// At rest and in the middle of a stroke.
  void require_finite() const {
    std::vector<expressions::Program> formulas, initial;
    for (const Asked& formula : asked_)
      make_of_formula(formula.text.file, formula.text.place(0),
                      [&] { formulas.push_back(program(formula.node)); });
    for (const FileState& state : effect_.states)
      initial.push_back(program(state.initial));
    for (const bool in_motion : {false, true}) {
      std::vector<double> inputs(effect_.inputs(), 0.0);
      for (size_t i = 0; i < quantity_count; ++i)
        if (in_motion || static_cast<In>(i) >= first_constant || static_cast<In>(i) == In::p_atm)
          inputs[i] = quantities[i].usual;
      for (const std::vector<double>& values : tried_values()) {
        std::ranges::copy(values, &inputs[effect_.input_of_parameter(0)]);
        for (size_t i = 0; i < initial.size(); ++i)
          inputs[effect_.input_of_state(i)] = initial[i](inputs.data());
        for (size_t i = 0; i < formulas.size(); ++i)
          if (!std::isfinite(formulas[i](inputs.data()))) fail_with(asked_[i], inputs);
      }
    }
  }
  [[noreturn]] void fail_with(const Asked& formula, const std::vector<double>& inputs) const {
    std::string with;
    for (size_t i = 0; i < inputs.size(); ++i)
      if (effect_.graph.depends_on(formula.node, i))
        with += fmt::format("{} {} = {:g}{}", with.empty() ? " with" : ",", name_of_input(i), inputs[i],
                            unit_of_input(i));
    fail(formula.text, "is not a finite number" + with,
         "A formula must be finite at rest and in motion: leave out where it is not, as in "
         "if(t > 0 [s], ..., 0) or max(p, 0.01 [kPa]), or correct its numbers or its parameters' bounds.");
  }

  void read_text() {
    std::optional<TableReader> text = root_.table_if("text");
    if (!text) return;
    effect_.source = text->text_or("source", "");
    effect_.looks_like = text->text_or("looks_like", "");
    effect_.reveals = text->text_or("reveals", "");
    effect_.looks_alike = text->texts_or("looks_alike", {});
    effect_.shows_with = text->texts_or("shows_with", {});
    text->finish();
  }

  TableReader root_;
  EffectFile effect_;
  Scope scope_;
  std::vector<Unit> state_units_;
  std::vector<Asked> asked_;
  PlacedText law_text_;   ///< of the law, if there is one
  std::string formulas_;  ///< all of them
};

}  // namespace

void make_of_formula(const std::string& file, const std::string& place, const std::function<void()>& make) {
  try {
    make();
  } catch (const std::length_error& error) {
    throw InputError({file, place, error.what(), "Simplify it: its slopes count, too."});
  } catch (const std::domain_error& error) {
    throw InputError({file, place, error.what(),
                      "A division by zero, or a logarithm of what is zero at rest? Every equation and its "
                      "slopes must be finite there."});
  }
}

EffectFile read_effect_file(const std::filesystem::path& path) {
  return Reader(TableReader::from_file(path)).read();
}

EffectFile read_effect_text(std::string_view text, std::string name) {
  return Reader(TableReader::from_text(text, std::move(name))).read();
}

}  // namespace diastole::effect_files
