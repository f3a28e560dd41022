#include "estimator/fe/elastic_model.hpp"

#include <algorithm>
#include <stdexcept>

#include "estimator/fe/load_path.hpp"

namespace diastole {
namespace {

constexpr double mL_per_mm3 = 1e-3;
constexpr double mJ_per_uJ = 1e-3;

}  // namespace

ParameterGroup whole_parameter(size_t parameter) { return {parameter, {}}; }

std::vector<ParameterGroup> each_element(size_t parameter, size_t element_count) {
  std::vector<ParameterGroup> groups;
  for (size_t e = 0; e < element_count; ++e)
    groups.push_back({parameter, {e}});
  return groups;
}

void ElasticModel::set_parameter(size_t parameter, double value) {
  for (size_t e = 0; e < mesh().element_count(); ++e)
    set_element_parameter(parameter, e, value);
}

Solution ElasticModel::solve(double pressure_kPa) { return solve(pressure_kPa, rest_state()); }

Solution ElasticModel::solve(double pressure_kPa, const ElasticState& start) {
  return solve(Load{pressure_kPa, start.fibre_tension_kPa}, start);
}

Solution ElasticModel::solve(const Load& load, const ElasticState& start,
                             std::shared_ptr<const CondensedFactor> near_by) {
  Solution path = follow_load(*system_, start, load, solve_options_, std::move(near_by));
  judge_end(path, load, start.pressure_kPa);
  return path;
}

void ElasticModel::judge_end(Solution& path, const Load& load, double start_kPa) {
  constexpr double nearly_vanished = 0.1;
  SolveReport& report = path.report;
  const bool pressure_path =
      !load.cavity_volume_mL && load.pressure_kPa != start_kPa && system_->cavity_closed();
  const bool gave_up = !report.converged() && report.reason != SolveReason::out_of_steps;
  if (!pressure_path || !gave_up || report.load_steps == 0) return;
  const std::optional<double> at_rest = cavity_stiffness_kPa_per_mL(rest_state());
  const std::optional<double> at_end = cavity_stiffness_kPa_per_mL(path.state);
  if (!at_rest || !at_end || !(*at_end < nearly_vanished * *at_rest)) return;
  report.reason = SolveReason::limit_point;
  report.pressure_limit = PressureLimit{.pressure_kPa = report.reached_pressure_kPa,
                                        .left = *at_end / *at_rest,
                                        .maximum = load.pressure_kPa > start_kPa};
  report.inverted.reset();
  report.beyond_law.reset();
}

Sensitivities ElasticModel::sensitivities(const ElasticState& at, std::span<const ParameterGroup> groups) {
  ElasticState state = at;
  state.held_volume_mm3.reset();
  const size_t unknowns = dofs();
  std::vector<double> right_sides((groups.size() + 1) * unknowns, 0.0);
  const auto column = [&](size_t number) {
    return std::span(right_sides).subspan(number * unknowns, unknowns);
  };
  const std::vector<double> area = system_->cavity_area(state);
  std::copy(area.begin(), area.end(), right_sides.begin());
  for (size_t g = 0; g < groups.size(); ++g) {
    system_->add_parameter_residual(state, groups[g].parameter, groups[g].elements, column(g + 1));
    for (double& value : column(g + 1))
      value = -value;
  }
  Sensitivities result;
  if (!system_->rim_skew().empty()) result.negative_pivots = system_->stability(state).negative_pivots;
  const FactorResult factor = system_->factorise(state);
  if (factor.singular) throw std::domain_error("an equilibrium with a singular tangent has no derivatives");
  if (system_->rim_skew().empty()) result.negative_pivots = factor.negative_pivots;
  system_->solve(right_sides, groups.size() + 1);
  result.pressure = system_->node_field(column(0));
  for (size_t g = 0; g < groups.size(); ++g)
    result.parameter.push_back(system_->node_field(column(g + 1)));
  return result;
}

double ElasticModel::cavity_volume_mL(const ElasticState& state) const {
  return mL_per_mm3 * system_->cavity_volume_mm3(state);
}

double ElasticModel::stored_energy_mJ(const ElasticState& state) const {
  const SystemResidual residual = system_->residual(state);
  return mJ_per_uJ * (residual.energy_uJ + residual.bond_energy_uJ);
}

std::optional<double> ElasticModel::cavity_stiffness_kPa_per_mL(const ElasticState& at) {
  ElasticState state = at;
  state.held_volume_mm3 = system_->cavity_volume_mm3(at);
  std::vector<double> change(system_->equations().unknowns(true), 0.0);
  change.back() = -1.0;  // minus the derivative of the volume's equation with respect to the volume
  if (system_->factorise(state).singular) return {};
  system_->solve(change);
  return change.back() / mL_per_mm3;
}

}  // namespace diastole
