#include "estimator/explain/field_solver.hpp"

#include <algorithm>
#include <utility>

#include "estimator/effects/affected_model.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/gauss_contraction.hpp"
#include "estimator/mesh/annulus.hpp"

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

void add_scaled(NodeField& field, double factor, const NodeField& direction) {
  for (size_t i = 0; i < field.size(); ++i)
    field[i] += factor * direction[i];
}

NodeField difference(const NodeField& a, const NodeField& b) {
  NodeField result = a;
  add_scaled(result, -1.0, b);
  return result;
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

FieldSolver::Slopes FieldSolver::slopes(size_t slot, const std::vector<FieldNudge>& nudges) {
  const ElasticState& at = state(slot);
  std::vector<std::vector<double>> right_sides(1, std::vector<double>(elastic_->dofs(), 0.0));
  elastic_->system().add_parameter_residual(at, 0, {}, right_sides.back());
  for (double& value : right_sides.back())
    value = -value;
  for (const FieldNudge& nudge : nudges) {
    FieldModel up = nudge.up;
    FieldModel down = nudge.down;
    up.displacement_gain = down.displacement_gain = 1.0;
    right_sides.emplace_back(elastic_->dofs(), 0.0);
    if (up == down) continue;
    right_sides.back() = residual_of(down, at);
    add_scaled(right_sides.back(), -1.0, residual_of(up, at));
    for (double& value : right_sides.back())
      value /= nudge.width;
  }
  std::vector<NodeField> fields = responses(slot, std::move(right_sides));
  for (NodeField& field : fields)
    for (double& value : field)
      value *= model_.displacement_gain;
  const NodeField displacement = displacement_mm(slot);
  for (size_t i = 0; i < nudges.size(); ++i)
    add_scaled(fields[1 + i],
               (nudges[i].up.displacement_gain - nudges[i].down.displacement_gain) / nudges[i].width,
               displacement);
  Slopes result{std::move(fields[0]), {}};
  std::move(fields.begin() + 1, fields.end(), std::back_inserter(result.model));
  return result;
}

NodeField FieldSolver::reference_slope(const FieldNudge& nudge) const {
  if (nudge.up.inner_radius_mm == nudge.down.inner_radius_mm) return {};
  NodeField slope = difference(make_annulus(shape_of(nudge.up, elements_)).reference(),
                               make_annulus(shape_of(nudge.down, elements_)).reference());
  for (double& value : slope)
    value /= nudge.width;
  return slope;
}

std::vector<std::vector<double>> FieldSolver::stiffness_sides(
    size_t slot, const std::vector<StiffnessField>& fields) const {
  const ElasticSystem& system = elastic_->system();
  std::vector<std::vector<double>> sides(fields.size(), std::vector<double>(elastic_->dofs(), 0.0));
  for (size_t e = 0; e < mesh().element_count(); ++e) {
    const ReferenceElement reference = make_reference_element(mesh(), e, system.material_axes());
    const GaussMatrices gradients = gradients_at_points(mesh().gather(e, state(slot).position_mm));
    std::array<Eigen::Matrix3d, gauss_points> piola;
    std::array<Eigen::Vector3d, gauss_points> X_mm;
    for (size_t q = 0; q < gauss_points; ++q) {
      const Eigen::Matrix3d& t = reference[q].material_to_xi;
      const Eigen::Matrix3d f = gradients.at(q) * t;
      const SymmetricTensor<double> stress =
          elastic_->law().stress_sensitivity(symmetric_part(f.transpose() * f), system.parameters(e), 0);
      piola[q] = -C1_kPa_ * reference[q].volume * f * full_matrix(stress) * t.transpose();
      X_mm[q] = mesh().value(mesh().reference(), {e, gauss_tables().xi[q]});
    }
    for (size_t i = 0; i < fields.size(); ++i) {
      GaussMatrices weighted;
      double most = 0.0;
      for (size_t q = 0; q < gauss_points; ++q) {
        const double factor = fields[i](X_mm[q]);
        most = std::max(most, std::abs(factor));
        weighted.set(q, factor * piola[q]);
      }
      if (most > 1e-6) system.equations().add_force(e, force_of(weighted), sides[i]);
    }
  }
  return sides;
}

std::vector<NodeField> FieldSolver::responses(size_t slot, std::vector<std::vector<double>> right_sides) {
  ElasticSystem& system = elastic_->system();
  const size_t unknowns = elastic_->dofs();
  std::vector<double> columns;
  columns.reserve(unknowns * right_sides.size());
  for (const std::vector<double>& side : right_sides)
    columns.insert(columns.end(), side.begin(), side.end());
  system.factorise(state(slot));
  system.solve(columns, right_sides.size());
  std::vector<NodeField> fields;
  for (size_t i = 0; i < right_sides.size(); ++i)
    fields.push_back(system.node_field(std::span(columns).subspan(i * unknowns, unknowns)));
  return fields;
}

}  // namespace diastole::explain
