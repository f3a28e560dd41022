#include "estimator/fit/unloaded_motion.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "estimator/fit/constrained_energy.hpp"
#include "estimator/mesh/node_field.hpp"

namespace diastole {

UnloadedMotion::UnloadedMotion(ElasticModel imaged, std::vector<ParameterGroup> groups, ImagedLoad load)
    : ElasticMotion(on_unloaded(imaged.system(), imaged.mesh().reference()), std::move(groups)),
      imaged_(std::move(imaged)),
      load_(load),
      pressure_kPa_(load.pressure_kPa),
      inverse_(imaged_.system()) {}

std::optional<std::string> UnloadedMotion::set_values(std::span<const double> values) {
  if (shape_ && std::ranges::equal(values, values_) && shape_->imaged.pressure_kPa == pressure_kPa_)
    return {};
  ElasticMotion::set_values(imaged_, groups(), values);
  UnloadedShape found = inverse_.solve(pressure_kPa_, shape_ ? &*shape_ : nullptr);
  if (!found.report.converged() && shape_) found = inverse_.solve(pressure_kPa_);
  if (!found.report.converged()) {
    if (shape_) ElasticMotion::set_values(imaged_, groups(), values_);  // those of shape_ again
    return found.report.describe();
  }
  shape_ = std::move(found);
  values_.assign(values.begin(), values.end());
  shape_derivatives_.reset();
  changed_model() = on_unloaded(imaged_.system(), shape_->reference_mm);
  return {};
}

MotionDerivatives UnloadedMotion::derivatives_at(const ElasticState& state) {
  if (!shape_derivatives_) shape_derivatives_ = inverse_.derivatives(*shape_, groups());
  ElasticSystem& system = changed_model().system();
  const size_t unknowns = system.equations().unknowns(), count = groups().size();
  std::vector<NodeField> shapes = shape_derivatives_->by_parameter;
  shapes.push_back(shape_derivatives_->by_pressure);
  // Columns: values, imaged pressure, cavity pressure.
  std::vector<double> right_sides((count + 2) * unknowns, 0.0);
  inverse_.add_reference_residual(shape_->reference_mm, state, shapes, right_sides);
  for (size_t g = 0; g < count; ++g)
    system.add_parameter_residual(state, groups()[g].parameter, groups()[g].elements,
                                  std::span(right_sides).subspan(g * unknowns, unknowns));
  for (double& value : right_sides)
    value = -value;
  std::ranges::copy(system.cavity_area(state), right_sides.end() - static_cast<std::ptrdiff_t>(unknowns));
  if (system.factorise(state).singular)
    throw std::domain_error("an equilibrium with a singular tangent has no derivatives");
  system.solve(right_sides, count + 2);
  const auto column = [&](size_t number) {
    return system.node_field(std::span(right_sides).subspan(number * unknowns, unknowns));
  };
  MotionDerivatives by;
  for (size_t g = 0; g < count; ++g)
    by.by_value.push_back(column(g));
  by.by_imaged_pressure = column(count);
  by.by_pressure = column(count + 1);
  return by;
}

double UnloadedMotion::stored_at(const ElasticState& state) const {
  return model().stored_energy_mJ(state) - model().stored_energy_mJ(shape_->imaged);
}

EnergyDerivatives UnloadedMotion::energy_derivatives_at(const ElasticState& state,
                                                        std::span<const double> values,
                                                        const MotionDerivatives& by) {
  const auto stored_mJ = [&](std::span<const double> at, double amount, const NodeField& along) {
    ElasticMotion::set_values(imaged_, groups(), at);
    NodeField shape_mm = shape_->reference_mm;
    add_scaled(shape_mm, amount, along);
    const ElasticModel body = on_unloaded(imaged_.system(), std::move(shape_mm));
    return constrained_energy_mJ(body, state) - constrained_energy_mJ(body, shape_->imaged);
  };
  if (!shape_derivatives_) shape_derivatives_ = inverse_.derivatives(*shape_, groups());
  EnergyDerivatives result;
  for (size_t i = 0; i < values.size(); ++i) {
    std::vector<double> above(values.begin(), values.end()), below = above;
    const double change = step_of(values[i]);
    above[i] += change;
    below[i] -= change;
    const NodeField& along = shape_derivatives_->by_parameter[i];
    result.by_value.push_back((stored_mJ(above, change, along) - stored_mJ(below, -change, along)) /
                                  (2 * change) +
                              pressure_work_mJ(model(), state, by.by_value[i]));
  }
  const double change_kPa = step_of(pressure_kPa_);
  const NodeField& along = shape_derivatives_->by_pressure;
  result.by_imaged_pressure =
      (stored_mJ(values, change_kPa, along) - stored_mJ(values, -change_kPa, along)) / (2 * change_kPa) +
      pressure_work_mJ(model(), state, by.by_imaged_pressure);
  result.by_pressure = pressure_work_mJ(model(), state, by.by_pressure);
  return result;
}

std::optional<UnloadedMotion::Again> UnloadedMotion::inflated_again(std::span<const double> values,
                                                                    double imaged_pressure_kPa) {
  set_imaged_pressure(imaged_pressure_kPa);
  if (set_values(values)) return {};
  ElasticModel again = on_unloaded(imaged_.system(), shape_->reference_mm, {.check_stability = true});
  const auto volume_mL = [](const ElasticModel& body) {
    return body.system().cavity_closed() ? body.cavity_volume_mL(body.rest_state())
                                         : std::numeric_limits<double>::quiet_NaN();
  };
  const double unloaded_mL = volume_mL(again);
  return Again{volume_mL(imaged_), unloaded_mL, inflate_again(again, imaged_.mesh(), imaged_pressure_kPa)};
}

}  // namespace diastole
