#include "estimator/materials/file_law.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "estimator/expressions/formula.hpp"
#include "estimator/expressions/program.hpp"
#include "estimator/materials/dual_response.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

using expressions::Graph;
using expressions::NodeId;
using expressions::Operation;
using expressions::Program;
using Tensor = SymmetricTensor<double>;
using Values = std::span<const double>;

constexpr size_t most_parameters = 32;
constexpr size_t strains = 6;  ///< inputs before the parameters: C by law.hpp's indices
/// Inputs behind the parameters while formulas are read: the invariants, which need no axes.
constexpr size_t first_invariant = strains + most_parameters;
constexpr size_t tangent_entries = 21;

struct Declared {
  std::string id;
  std::vector<std::string> names, meanings, units;  ///< of the parameters
  std::vector<LawParameter> parameters;
  Graph graph;
  NodeId energy = 0;
  bool needs_axes = false;
};

class FileLaw final : public Law {
  template <class Scalar>
  using Inputs = std::array<Scalar, strains + most_parameters>;

  Inputs<double> inputs(const Tensor& c, Values values) const {
    Inputs<double> all;
    std::ranges::copy(c, all.begin());
    std::copy_n(values.begin(), declared_.parameters.size(), all.begin() + strains);
    return all;
  }
  auto constants_of(Values values) const {
    return [values, count = declared_.parameters.size()]<class Scalar>() {
      std::array<Scalar, most_parameters> result;
      for (size_t i = 0; i < count; ++i)
        result[i] = constant<Scalar>(values[i]);
      return result;
    };
  }
  auto of_duals() const {
    return [this]<class Scalar>(const SymmetricTensor<Scalar>& c,
                                const std::array<Scalar, most_parameters>& values) {
      Inputs<Scalar> all;
      std::ranges::copy(c, all.begin());
      std::copy_n(values.begin(), declared_.parameters.size(), all.begin() + strains);
      Scalar w = constant<Scalar>(0.0);
      energy_.run(all.data(), &w);
      return w;
    };
  }

 public:
  explicit FileLaw(Declared declared) : declared_(std::move(declared)) {
    for (size_t i = 0; i < declared_.parameters.size(); ++i) {
      declared_.parameters[i].name = declared_.names[i];
      declared_.parameters[i].meaning = declared_.meanings[i];
      declared_.parameters[i].unit = declared_.units[i];
    }
    Graph& graph = declared_.graph;
    energy_ = Program(graph, std::vector{declared_.energy});
    std::vector<NodeId> response, stress;
    for (size_t m = 0; m < strains; ++m)
      stress.push_back(graph.scaled(stress_weight(m), graph.derivative(declared_.energy, m)));
    response = stress;
    for (size_t m = 0; m < strains; ++m)
      for (size_t n = m; n < strains; ++n)
        response.push_back(graph.scaled(stress_weight(n), graph.derivative(stress[m], n)));
    stress_ = Program(graph, stress);
    response_ = Program(graph, response);
  }

  std::string_view name() const override { return declared_.id; }
  bool needs_axes() const override { return declared_.needs_axes; }
  std::span<const LawParameter> parameters() const override { return declared_.parameters; }

  double energy(const Tensor& c, Values values) const override { return energy_(inputs(c, values).data()); }
  Tensor stress(const Tensor& c, Values values) const override {
    Tensor result;
    stress_.run(inputs(c, values).data(), result.data());
    return result;
  }
  MaterialResponse response(const Tensor& c, Values values) const override {
    std::array<double, strains + tangent_entries> outputs;
    response_.run(inputs(c, values).data(), outputs.data());
    MaterialResponse result;
    std::copy_n(outputs.begin(), strains, result.stress.begin());
    size_t at = strains;
    for (Eigen::Index m = 0; m < 6; ++m)
      for (Eigen::Index n = m; n < 6; ++n)
        result.tangent(m, n) = result.tangent(n, m) = outputs[at++];
    return result;
  }
  Tensor stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    return dual_stress_sensitivity(c, values, parameter);
  }
  MaterialResponse dual_response(const Tensor& c, Values values) const override {
    return dual_response_of(of_duals(), c, constants_of(values));
  }
  Tensor dual_stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    return dual_stress_sensitivity_of(of_duals(), c, constants_of(values), parameter);
  }

 private:
  Declared declared_;
  Program energy_, stress_, response_;
};

/// I1, I2, I3 of C.
std::array<NodeId, 3> invariants_of(Graph& graph) {
  std::array<NodeId, strains> c{};
  for (size_t m = 0; m < strains; ++m)
    c[m] = graph.input(m);
  const auto square = [&](size_t m) { return graph.product(c[m], c[m]); };
  const auto less = [&](NodeId a, NodeId b) { return graph.make(Operation::subtract, a, b); };
  const NodeId minor_ff = less(graph.product(c[1], c[2]), square(4));
  const NodeId minor_ss = less(graph.product(c[2], c[0]), square(5));
  const NodeId minor_nn = less(graph.product(c[0], c[1]), square(3));
  const NodeId minor_fs = less(graph.product(c[3], c[2]), graph.product(c[4], c[5]));
  const NodeId minor_nf = less(graph.product(c[3], c[4]), graph.product(c[1], c[5]));
  return {graph.sum(graph.sum(c[0], c[1]), c[2]), graph.sum(graph.sum(minor_ff, minor_ss), minor_nn),
          graph.sum(less(graph.product(c[0], minor_ff), graph.product(c[3], minor_fs)),
                    graph.product(c[5], minor_nf))};
}

/// The names of C, E and their invariants.
expressions::Scope strain_names(Graph& graph) {
  expressions::Scope scope;
  const auto name = [&](std::string text, NodeId node) { scope.names[std::move(text)] = {node, {}}; };
  std::array<NodeId, strains> c{};
  for (size_t m = 0; m < strains; ++m)
    c[m] = graph.input(m);
  constexpr std::array<std::array<std::string_view, 2>, strains> spelled{
      {{"ff", "ff"}, {"ss", "ss"}, {"nn", "rr"}, {"fs", "fs"}, {"sn", "sr"}, {"nf", "fr"}}};
  for (size_t m = 0; m < strains; ++m) {
    const NodeId change = m < 3 ? graph.make(Operation::subtract, c[m], graph.number(1.0)) : c[m];
    for (const std::string_view entry : spelled[m]) {
      name("C" + std::string(entry), c[m]);
      name("E" + std::string(entry), graph.scaled(0.5, change));
    }
    name("I" + std::string(m < 3 ? "4" : "8") + std::string(m < 3 ? spelled[m][0].substr(1) : spelled[m][0]),
         c[m]);
  }
  name("lambda_f", graph.make(Operation::root, c[0]));
  for (size_t i = 0; i < 3; ++i)
    name(fmt::format("I{}", i + 1), graph.input(first_invariant + i));
  return scope;
}

/// Whether the energy reads a direction is seen before invariants are what they are of C.
void put_invariants_in(Declared& law) {
  for (size_t m = 0; m < strains; ++m)
    law.needs_axes = law.needs_axes || law.graph.depends_on(law.energy, m);
  const std::array<NodeId, 3> invariants = invariants_of(law.graph);
  for (size_t i = 0; i < 3; ++i)
    law.energy = law.graph.substituted(law.energy, first_invariant + i, invariants[i]);
}

/// Of C, by 5 % and at a constant volume: stretches along each axis and shears in each plane, both ways.
std::vector<Tensor> small_distortions() {
  std::vector<Tensor> all;
  for (const double by : {0.05, -0.05}) {
    for (size_t m = 0; m < strains; ++m) {
      Tensor& c = all.emplace_back(undeformed);
      const auto [i, j] = symmetric_entries[m];
      if (i == j) {
        c = {1.0 / (1.0 + by), 1.0 / (1.0 + by), 1.0 / (1.0 + by), 0.0, 0.0, 0.0};
        c[m] = (1.0 + by) * (1.0 + by);
      } else {
        c[j] += by * by;
        c[m] = by;
      }
    }
  }
  return all;
}

/// Refuses, at typical values, what no body can be made of.
void require_rest(const Law& law, const PlacedText& energy) {
  const auto fail = [&](std::string problem, std::string remedy) {
    throw InputError({energy.file, energy.place(0), std::move(problem), std::move(remedy)});
  };
  std::vector<double> typical;
  for (const LawParameter& parameter : law.parameters())
    typical.push_back(parameter.typical);
  const double at_rest = law.energy(undeformed, typical);
  const MaterialResponse rest = law.response(undeformed, typical);
  const auto is_finite = [](double value) { return std::isfinite(value); };
  if (!std::isfinite(at_rest) || !std::ranges::all_of(rest.stress, is_finite) || !rest.tangent.allFinite())
    fail("is not finite at rest, or its stress or tangent is not",
         "At rest C is the unit tensor: I1 - 3 is 0, which has no inverse, no logarithm and a root without a "
         "slope.");
  const double pressure = law.rest_pressure_kPa(typical);
  const double scale = std::abs(pressure) + rest.tangent.norm();
  for (size_t m = 0; m < strains; ++m)
    if (std::abs(rest.stress[m] - (m < 3 ? pressure : 0.0)) > 1e-9 * scale)
      fail(fmt::format("at rest its stress is no pressure: {:.4g} kPa (ff, ss, nn, fs, sn, nf)",
                       fmt::join(rest.stress, ", ")),
           "The solver balances a pressure alone: count strains from rest, as in (I4f - 1)^2.");
  double most = 0.0, least = 0.0;
  for (const Tensor& c : small_distortions()) {
    const double cost = law.energy(c, typical) - at_rest;
    most = std::max(most, cost);
    least = std::min(least, cost);
  }
  const double rounding = 1e-12 * scale;
  if (least < -rounding || most <= rounding)
    fail(
        least < -rounding ? "falls where the body is distorted" : "costs nothing where the body is distorted",
        "A stretch or shear of 5 % must need energy: check the signs, and that it depends on more than I3.");
}

void read_parameter(TableReader& table, expressions::Scope& scope, Declared& law) {
  const std::string name = table.text("name");
  if (!expressions::is_name(name) || scope.names.contains(name))
    table.fail("name", fmt::format("\"{}\" cannot be a parameter's name", name),
               "Write a letter, then letters, digits and _, that have no meaning in formulas yet.");
  const std::string written = table.text_or("unit", "1");
  const auto unit = expressions::parse_unit(written);
  if (!unit)
    table.fail("unit", fmt::format("\"{}\" is no unit that is known", written),
               "Write for example \"kPa\" or \"1\".");
  const bool is_pressure = unit->same_dimension(*expressions::parse_unit("kPa"));
  if (is_pressure && expressions::factor_between(*unit, *expressions::parse_unit("kPa")) != 1.0)
    table.fail("unit", fmt::format("\"{}\" is no unit of a law's stiffness", written),
               "Write \"kPa\", and the numbers so.");
  const std::vector<double> bounds = table.numbers("bounds", 2);
  if (!(bounds[0] < bounds[1]))
    table.fail("bounds", fmt::format("[{}, {}] is not an interval", bounds[0], bounds[1]),
               "Write [lower, upper] with lower < upper; values lie above the lower one.");
  const double typical = table.number("typical", {.above = bounds[0], .at_most = bounds[1]});
  law.names.push_back(name);
  law.meanings.push_back(table.text_or("meaning", ""));
  law.units.push_back(is_pressure ? "kPa" : written);
  scope.names[name] = {law.graph.input(strains + law.parameters.size()), *unit};
  law.parameters.push_back(
      {.name = {}, .meaning = {}, .above = bounds[0], .typical = typical, .unit = {}, .at_most = bounds[1]});
  table.finish();
}

std::unique_ptr<const Law> made_law(Declared law, const PlacedText& energy) {
  try {
    put_invariants_in(law);
    return std::make_unique<FileLaw>(std::move(law));
  } catch (const std::exception& error) {
    throw InputError({energy.file, energy.place(0), error.what(), "Simplify the energy."});
  }
}

std::unique_ptr<const Law> read_law(TableReader root) {
  root.expect_format("diastole-law", 1);
  Declared law;
  law.id = expressions::read_id(root);
  if (find_law(law.id) != nullptr)
    root.fail("id", fmt::format("\"{}\" is a built-in law", law.id), "Give yours another name.");
  root.text_or("title", "");
  root.text_or("source", "");
  expressions::Scope scope = strain_names(law.graph);
  std::vector<TableReader> parameters = root.tables("parameter");
  if (parameters.empty() || parameters.size() > most_parameters)
    root.fail("parameter", fmt::format("the law has {} parameters", parameters.size()),
              fmt::format("Give from 1 to {} [[parameter]].", most_parameters));
  for (TableReader& table : parameters)
    read_parameter(table, scope, law);
  if (std::optional<TableReader> definitions = root.table_if("definitions")) {
    for (const auto& [name, text] : definitions->named_texts()) {
      if (!expressions::is_name(name) || scope.names.contains(name))
        definitions->fail(name, "has a meaning already", "Choose another name.");
      scope.names[name] = expressions::parse_formula(text, scope, law.graph);
    }
    definitions->finish();
  }
  const PlacedText energy = root.placed_text("energy_kPa");
  law.energy =
      expressions::parse_formula_in(energy, scope, law.graph, *expressions::parse_unit("kPa"), "energy_kPa");
  root.finish();
  for (size_t i = 0; i < parameters.size(); ++i)
    if (!law.graph.depends_on(law.energy, strains + i))
      parameters[i].fail("name", fmt::format("the energy does not depend on {}", law.names[i]),
                         "Remove the parameter, or use it.");
  std::unique_ptr<const Law> made = made_law(std::move(law), energy);
  require_rest(*made, energy);
  return made;
}

}  // namespace

std::unique_ptr<const Law> read_law_file(const std::filesystem::path& path) {
  return read_law(TableReader::from_file(path));
}

std::unique_ptr<const Law> read_law_text(std::string_view text, std::string name) {
  return read_law(TableReader::from_text(text, std::move(name)));
}

const Law& law_of_file(const std::filesystem::path& path) {
  static std::mutex mutex;
  static std::map<std::filesystem::path, std::unique_ptr<const Law>> laws;
  const std::lock_guard lock(mutex);
  std::unique_ptr<const Law>& law = laws[std::filesystem::absolute(path).lexically_normal()];
  if (law == nullptr) law = read_law_file(path);
  return *law;
}

}  // namespace diastole
