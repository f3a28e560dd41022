#include "estimator/explain/imaging/field_solver.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/fe/gauss_contraction.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/model/affected_model.hpp"

namespace diastole::explain {
namespace {

AnnulusShape shape_of(const FieldModel& model, const std::array<size_t, 3>& elements) {
  AnnulusShape shape;
  shape.inner_radius_mm = model.inner_radius_mm;
  shape.outer_radius_mm = model.outer_radius_mm;
  shape.height_mm = model.height_mm;
  shape.elements = elements;
  return shape;
}

}  // namespace

std::unique_ptr<ElasticModel> FieldSolver::build(const FieldModel& model) const {
  HermiteMesh mesh = make_annulus(shape_of(model, elements_));
  FieldElasticity elastic = elasticity_of(model, mesh, C1_kPa_);
  elastic.options.solve.tolerance = 1e-8;
  return std::make_unique<ElasticModel>(std::move(mesh), *elastic.law, std::move(elastic.options));
}

void FieldSolver::set(const FieldModel& model, double C1_kPa) {
  C1_kPa_ = C1_kPa;
  if (elastic_ && model == model_) {
    elastic_->set_parameter(0, C1_kPa);
    return;
  }
  std::unique_ptr<ElasticModel> previous = std::exchange(elastic_, build(model));
  if (!previous || model.inner_radius_mm != model_.inner_radius_mm)
    reference_ = std::make_unique<PointLocator>(mesh(), mesh().reference(), locator_);
  model_ = model;
  for (std::optional<ElasticState>& state : states_)
    if (state) state = carried_over(*state, previous->mesh());
}

ElasticState FieldSolver::carried_over(const ElasticState& state, const HermiteMesh& from) const {
  ElasticState carried = elastic_->rest_state();
  carried.pressure_kPa = state.pressure_kPa;
  carried.chamber_pressure_kPa = elastic_->system().chamber() ? state.chamber_pressure_kPa : 0.0;
  carried.lagrange_pressure_kPa = state.lagrange_pressure_kPa;
  const HeldDofs& held = elastic_->system().held();
  const NodeField displacement_mm = difference(state.position_mm, from.reference());
  for (size_t dof = 0; dof < held.size(); ++dof)
    if (held[dof] == 0) carried.position_mm[dof] += displacement_mm[dof];
  return carried;
}

bool FieldSolver::solve(size_t slot, double pressure_kPa) {
  if (states_.size() <= slot) states_.resize(slot + 1);
  const auto begun =
      std::find_if(states_.rbegin(), states_.rend(), [](const auto& s) { return s.has_value(); });
  std::optional<ElasticState> start = states_[slot];
  if (!start && begun != states_.rend()) start = *begun;
  Solution solution = start ? elastic_->solve(pressure_kPa, *start) : elastic_->solve(pressure_kPa);
  if (!solution.report.converged() && start) solution = elastic_->solve(pressure_kPa);
  if (!solution.report.converged()) return false;
  states_[slot] = std::move(solution.state);
  return true;
}

NodeField FieldSolver::displacement_mm(size_t slot) const {
  return difference(state(slot).position_mm, mesh().reference());
}

NodeField FieldSolver::seen_displacement_mm(size_t slot) const {
  NodeField seen = displacement_mm(slot);
  for (double& value : seen)
    value *= model_.displacement_gain;
  return seen;
}

std::vector<double> FieldSolver::residual_of(const FieldModel& model, const ElasticState& state) const {
  const std::unique_ptr<ElasticModel> other = build(model);
  ElasticState moved = state;
  add_scaled(moved.position_mm, 1.0, difference(other->mesh().reference(), mesh().reference()));
  return other->system().residual(moved).values;
}

FieldSolver::Slopes FieldSolver::slopes(size_t slot, const std::vector<FieldPerturbation>& perturbations) {
  const ElasticState& at = state(slot);
  std::vector<std::vector<double>> right_sides(1, std::vector<double>(elastic_->dofs(), 0.0));
  elastic_->system().add_parameter_residual(at, 0, {}, right_sides.back());
  for (double& value : right_sides.back())
    value = -value;
  for (const FieldPerturbation& perturbation : perturbations) {
    FieldModel up = perturbation.up;
    FieldModel down = perturbation.down;
    up.displacement_gain = down.displacement_gain = 1.0;
    right_sides.emplace_back(elastic_->dofs(), 0.0);
    if (up == down) continue;
    right_sides.back() = residual_of(down, at);
    add_scaled(right_sides.back(), -1.0, residual_of(up, at));
    for (double& value : right_sides.back())
      value /= perturbation.width;
  }
  std::vector<NodeField> fields = responses(slot, right_sides);
  for (NodeField& field : fields)
    for (double& value : field)
      value *= model_.displacement_gain;
  const NodeField displacement = displacement_mm(slot);
  for (size_t i = 0; i < perturbations.size(); ++i)
    add_scaled(fields[1 + i],
               (perturbations[i].up.displacement_gain - perturbations[i].down.displacement_gain) /
                   perturbations[i].width,
               displacement);
  Slopes result{std::move(fields[0]), {}};
  std::move(fields.begin() + 1, fields.end(), std::back_inserter(result.model));
  return result;
}

NodeField FieldSolver::reference_slope(const FieldPerturbation& perturbation) const {
  if (perturbation.up.inner_radius_mm == perturbation.down.inner_radius_mm) return {};
  NodeField slope = difference(make_annulus(shape_of(perturbation.up, elements_)).reference(),
                               make_annulus(shape_of(perturbation.down, elements_)).reference());
  for (double& value : slope)
    value /= perturbation.width;
  return slope;
}

std::vector<NodeField> responses(ElasticModel& body, const ElasticState& state,
                                 const std::vector<std::vector<double>>& right_sides) {
  ElasticSystem& system = body.system();
  const size_t unknowns = body.dofs();
  std::vector<double> columns;
  columns.reserve(unknowns * right_sides.size());
  for (const std::vector<double>& side : right_sides)
    columns.insert(columns.end(), side.begin(), side.end());
  system.factorise(state);
  system.solve(columns, right_sides.size());
  std::vector<NodeField> fields;
  for (size_t i = 0; i < right_sides.size(); ++i)
    fields.push_back(system.node_field(std::span(columns).subspan(i * unknowns, unknowns)));
  return fields;
}

GaussNumbers at_gauss_points(const HermiteMesh& mesh,
                             const std::function<double(const MaterialPoint&)>& field) {
  GaussNumbers numbers(mesh.element_count());
  for (size_t e = 0; e < mesh.element_count(); ++e)
    for (size_t q = 0; q < gauss_points; ++q)
      numbers[e][q] = field({e, gauss_tables().xi[q]});
  return numbers;
}

std::vector<std::vector<double>> stiffness_sides(const ElasticSystem& system, const ElasticState& state,
                                                 const std::vector<GaussNumbers>& fields) {
  constexpr double least = 1e-6;
  const HermiteMesh& mesh = system.mesh();
  std::vector<std::vector<double>> sides(fields.size(),
                                         std::vector<double>(system.equations().unknowns(), 0.0));
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::optional<std::array<Eigen::Matrix3d, gauss_points>> forces;
    for (size_t i = 0; i < fields.size(); ++i) {
      const std::array<double, gauss_points>& here = fields[i][e];
      if (std::ranges::all_of(here, [](double value) { return std::abs(value) <= least; })) continue;
      if (!forces)
        forces =
            element_stiffness_forces(make_reference_element(mesh, e, system.material_axes()),
                                     mesh.gather(e, state.position_mm), system.law(), system.parameters(e));
      GaussMatrices weighted;
      for (size_t q = 0; q < gauss_points; ++q)
        weighted.set(q, -here[q] * (*forces)[q]);
      system.equations().add_force(e, force_of(weighted), sides[i]);
    }
  }
  return sides;
}

}  // namespace diastole::explain
