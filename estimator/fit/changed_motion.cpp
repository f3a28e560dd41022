#include "estimator/fit/changed_motion.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "estimator/mesh/node_field.hpp"

namespace diastole {
namespace {

/// The part of a change that the body itself has.
FieldModel of_the_body(FieldModel change) {
  const FieldModel none;
  change.displacement_gain = none.displacement_gain;
  change.pressure_offset_kPa = none.pressure_offset_kPa;
  change.base_motion_mm_per_kPa = none.base_motion_mm_per_kPa;
  return change;
}

void add_everywhere(NodeField& field, double factor, const std::array<double, 3>& motion_mm) {
  for (size_t node = 0; node < field.size() / dofs_per_node; ++node)
    for (size_t i = 0; i < 3; ++i)
      field[dof_of(node, 0, i)] += factor * motion_mm[i];
}

}  // namespace

ChangedMotion::ChangedMotion(BodyChanges changes, std::vector<ParameterGroup> groups,
                             std::vector<double> start)
    : ElasticMotion(changes.body(changes.change(start)), std::move(groups)),
      changes_(std::move(changes)),
      change_(changes_.change(start)),
      unknown_(std::move(start)),
      from_rest_(change_.opening_angle_deg != 0.0) {
  for (size_t i = 0; i < unknown_.size(); ++i) {
    const Perturbation by = perturbation(i, unknown_);
    from_rest_ = from_rest_ || by.up.opening_angle_deg != by.down.opening_angle_deg;
  }
}

ChangedMotion::Perturbation ChangedMotion::perturbation(size_t unknown, std::span<const double> at) const {
  std::vector<double> values(at.begin(), at.end());
  const double step = changes_.steps[unknown];
  values[unknown] = at[unknown] + step;
  FieldModel up = changes_.change(values);
  values[unknown] = at[unknown] - step;
  return {std::move(up), changes_.change(values), 2.0 * step};
}

std::optional<std::string> ChangedMotion::set_values(std::span<const double> values) {
  const std::span<const double> law = values.first(groups().size());
  if (!std::ranges::equal(unknown(values), unknown_)) {
    FieldModel change = changes_.change(unknown(values));
    unknown_.assign(unknown(values).begin(), unknown(values).end());
    if (of_the_body(change) != of_the_body(change_)) changed_model() = changes_.body(change);
    change_ = std::move(change);
  }
  law_values_.assign(law.begin(), law.end());
  ElasticMotion::set_values(changed_model(), groups(), law);
  return {};
}

std::vector<double> ChangedMotion::right_side(const Perturbation& change, const ElasticState& state) const {
  std::vector<double> side(model().dofs(), 0.0);
  if (of_the_body(change.up) == of_the_body(change.down)) return side;
  const auto residual = [&](const FieldModel& of) {
    ElasticModel body = changes_.body(of);
    ElasticMotion::set_values(body, groups(), law_values_);
    return body.system().residual(state).values;
  };
  const std::vector<double> up = residual(change.up);
  side = residual(change.down);
  for (size_t i = 0; i < side.size(); ++i)
    side[i] = (side[i] - up[i]) / change.width;
  return side;
}

MotionDerivatives ChangedMotion::derivatives_at(const ElasticState& state) {
  MotionDerivatives by = ElasticMotion::derivatives_at(state);
  if (unknown_.empty()) return by;
  std::vector<double> sides;
  for (size_t i = 0; i < unknown_.size(); ++i) {
    const std::vector<double> side = right_side(perturbation(i, unknown_), state);
    sides.insert(sides.end(), side.begin(), side.end());
  }
  ElasticSystem& system = changed_model().system();
  system.solve(sides, unknown_.size());
  for (size_t i = 0; i < unknown_.size(); ++i)
    by.by_value.push_back(system.node_field(std::span(sides).subspan(i * model().dofs(), model().dofs())));
  return by;
}

NodeField ChangedMotion::displacement_mm(size_t slot) const {
  return difference(state(slot_of(slot)).position_mm,
                    from_rest_ ? state(rest_slot).position_mm : mesh().reference());
}

MotionOutcome ChangedMotion::solve(size_t slot, std::span<const double> values, double pressure_kPa) {
  const FieldModel change = changes_.change(unknown(values));
  if (from_rest_) {
    MotionOutcome rest = ElasticMotion::solve(rest_slot, values, 0.0);
    if (!rest.position_mm) return rest;
  }
  MotionOutcome outcome =
      ElasticMotion::solve(slot_of(slot), values, pressure_kPa - change.pressure_offset_kPa);
  if (!outcome.position_mm) return outcome;
  if (pressures_kPa_.size() <= slot) pressures_kPa_.resize(slot + 1);
  pressures_kPa_[slot] = pressure_kPa;
  NodeField seen_mm = mesh().reference();
  add_scaled(seen_mm, change.displacement_gain, displacement_mm(slot));
  add_everywhere(seen_mm, pressure_kPa, change.base_motion_mm_per_kPa);
  outcome.position_mm = std::move(seen_mm);
  return outcome;
}

void ChangedMotion::add_seen(size_t slot, const Perturbation& change, const NodeField& by_pressure,
                             NodeField& by) const {
  const auto& [up, down, width] = change;
  if (up.displacement_gain != down.displacement_gain)
    add_scaled(by, (up.displacement_gain - down.displacement_gain) / width, displacement_mm(slot));
  add_scaled(by, -(up.pressure_offset_kPa - down.pressure_offset_kPa) / width, by_pressure);
  std::array<double, 3> motion{};
  for (size_t i = 0; i < 3; ++i)
    motion[i] = (up.base_motion_mm_per_kPa[i] - down.base_motion_mm_per_kPa[i]) / width;
  add_everywhere(by, pressures_kPa_.at(slot), motion);
}

MotionDerivatives ChangedMotion::derivatives(size_t slot) {
  MotionDerivatives by = ElasticMotion::derivatives(slot_of(slot));
  if (from_rest_) {
    const MotionDerivatives rest = ElasticMotion::derivatives(rest_slot);
    for (size_t i = 0; i < by.by_value.size(); ++i)
      add_scaled(by.by_value[i], -1.0, rest.by_value[i]);
  }
  for (NodeField& field : by.by_value)
    for (double& number : field)
      number *= change_.displacement_gain;
  for (double& number : by.by_pressure)
    number *= change_.displacement_gain;
  for (size_t i = 0; i < unknown_.size(); ++i)
    add_seen(slot, perturbation(i, unknown_), by.by_pressure, by.by_value[groups().size() + i]);
  add_everywhere(by.by_pressure, 1.0, change_.base_motion_mm_per_kPa);
  return by;
}

ChangedMotion::Equilibrium ChangedMotion::equilibrium_at(size_t own_slot) {
  (void)ElasticMotion::derivatives(own_slot);
  if (changed_model().system().factorise(state(own_slot)).singular)
    throw std::domain_error("an equilibrium with a singular tangent has no derivatives");
  return {changed_model(), state(own_slot)};
}

std::vector<NodeField> ChangedMotion::by_changes(size_t slot, const std::vector<Perturbation>& changes) {
  const MotionDerivatives seen = derivatives(slot);
  const bool residual = std::ranges::any_of(changes, [](const Perturbation& change) {
    return change.up.opening_angle_deg != change.down.opening_angle_deg;
  });
  const auto moved = [&](const Equilibrium& at) {
    std::vector<double> sides;
    for (const Perturbation& change : changes) {
      const std::vector<double> side = right_side(change, at.state);
      sides.insert(sides.end(), side.begin(), side.end());
    }
    at.body.system().solve(sides, changes.size());
    std::vector<NodeField> fields;
    for (size_t i = 0; i < changes.size(); ++i)
      fields.push_back(
          at.body.system().node_field(std::span(sides).subspan(i * at.body.dofs(), at.body.dofs())));
    return fields;
  };
  std::vector<NodeField> fields = moved(equilibrium(slot));
  if (residual) {
    std::vector<double> values = law_values_;
    values.insert(values.end(), unknown_.begin(), unknown_.end());
    if (ElasticMotion::solve(rest_slot, values, 0.0).position_mm) {
      const std::vector<NodeField> rest = moved(equilibrium_at(rest_slot));
      for (size_t i = 0; i < fields.size(); ++i)
        add_scaled(fields[i], -1.0, rest[i]);
    }
  }
  for (size_t i = 0; i < fields.size(); ++i) {
    for (double& number : fields[i])
      number *= change_.displacement_gain;
    add_seen(slot, changes[i], seen.by_pressure, fields[i]);
  }
  return fields;
}

}  // namespace diastole
