#include "estimator/materials/file_law.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
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
constexpr size_t tangent_entries = 21;

struct Declared {
  std::string id;
  std::vector<std::string> names, meanings;  ///< of the parameters
  std::vector<LawParameter> parameters;
  Graph graph;
  NodeId energy = 0;
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
    needs_axes_ = finds_axes();
  }

  std::string_view name() const override { return declared_.id; }
  bool needs_axes() const override { return needs_axes_; }
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
  /// Whether a body turned within its axes has another energy, at a strain without symmetry.
  bool finds_axes() const {
    Eigen::Matrix3d f;
    f << 1.12, 0.08, -0.05, 0.03, 0.95, 0.11, -0.04, 0.06, 1.02;
    std::vector<double> typical;
    for (const LawParameter& parameter : declared_.parameters)
      typical.push_back(parameter.typical);
    const auto energy_of = [&](const Eigen::Matrix3d& g) {
      return energy(symmetric_part(g.transpose() * g), typical);
    };
    const double still = energy_of(f);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      if (std::abs(energy_of(f * turn) - still) > 1e-9 * std::abs(still)) return true;
    }
    return false;
  }

  Declared declared_;
  Program energy_, stress_, response_;
  bool needs_axes_ = false;
};

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
  const auto square = [&](size_t m) { return graph.product(c[m], c[m]); };
  const auto less = [&](NodeId a, NodeId b) { return graph.make(Operation::subtract, a, b); };
  const NodeId minor_ff = less(graph.product(c[1], c[2]), square(4));
  const NodeId minor_ss = less(graph.product(c[2], c[0]), square(5));
  const NodeId minor_nn = less(graph.product(c[0], c[1]), square(3));
  name("I1", graph.sum(graph.sum(c[0], c[1]), c[2]));
  name("I2", graph.sum(graph.sum(minor_ff, minor_ss), minor_nn));
  const NodeId minor_fs = less(graph.product(c[3], c[2]), graph.product(c[4], c[5]));
  const NodeId minor_nf = less(graph.product(c[3], c[4]), graph.product(c[1], c[5]));
  name("I3", graph.sum(less(graph.product(c[0], minor_ff), graph.product(c[3], minor_fs)),
                       graph.product(c[5], minor_nf)));
  return scope;
}

void read_parameter(TableReader& table, expressions::Scope& scope, Declared& law) {
  const std::string name = table.text("name");
  if (!expressions::is_name(name) || scope.names.contains(name))
    table.fail("name", fmt::format("\"{}\" cannot be a parameter's name", name),
               "Write letters, digits and _ that have no meaning in formulas yet.");
  const std::string written = table.text_or("unit", "1");
  const auto unit = expressions::parse_unit(written);
  if (!unit)
    table.fail("unit", fmt::format("\"{}\" is no unit that is known", written),
               "Write for example \"kPa\" or \"1\".");
  const std::vector<double> bounds = table.numbers("bounds", 2);
  if (!(bounds[0] < bounds[1]))
    table.fail("bounds", fmt::format("[{}, {}] is not an interval", bounds[0], bounds[1]),
               "Write [lower, upper] with lower < upper; values lie above the lower one.");
  const double typical = table.number("typical", {.above = bounds[0], .at_most = bounds[1]});
  law.names.push_back(name);
  law.meanings.push_back(table.text_or("meaning", ""));
  scope.names[name] = {law.graph.input(strains + law.parameters.size()), *unit};
  law.parameters.push_back({.name = {}, .meaning = {}, .above = bounds[0], .typical = typical});
  table.finish();
}

std::unique_ptr<const Law> read_law(TableReader root) {
  root.expect_format("diastole-law", 1);
  Declared law;
  law.id = root.text("id");
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
  try {
    return std::make_unique<FileLaw>(std::move(law));
  } catch (const std::exception& error) {
    throw InputError({energy.file, energy.place(0), error.what(), "Simplify the energy."});
  }
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
