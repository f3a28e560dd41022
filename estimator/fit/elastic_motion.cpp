#include "estimator/fit/elastic_motion.hpp"

#include <cmath>

#include "estimator/mesh/node_field.hpp"

namespace diastole {
void ElasticMotion::set_values(std::span<const double> values) {
  for (size_t i = 0; i < groups_.size(); ++i) {
    const ParameterGroup& group = groups_[i];
    if (group.elements.empty()) {
      model_.set_parameter(group.parameter, values[i]);
    } else {
      for (const size_t element : group.elements)
        model_.set_element_parameter(group.parameter, element, values[i]);
    }
  }
}

// The slot itself, or on its first use the solved one of the nearest pressure.
const ElasticMotion::Slot* ElasticMotion::nearest(size_t slot, double pressure_kPa) const {
  if (slot < slots_.size() && slots_[slot]) return &*slots_[slot];
  const Slot* best = nullptr;
  for (const auto& candidate : slots_) {
    if (!candidate) continue;
    const auto distance = [&](const Slot& s) { return std::abs(s.state.pressure_kPa - pressure_kPa); };
    if (best == nullptr || distance(*candidate) < distance(*best)) best = &*candidate;
  }
  return best;
}

Solution ElasticMotion::solve_from(const Slot* start, std::span<const double> values, double pressure_kPa) {
  if (start != nullptr && start->derivatives) {
    ElasticState guess = start->state;
    add_scaled(guess.position_mm, pressure_kPa - guess.pressure_kPa, start->derivatives->by_pressure);
    for (size_t i = 0; i < values.size(); ++i) {
      add_scaled(guess.position_mm, values[i] - start->values[i], start->derivatives->by_value[i]);
    }
    guess.pressure_kPa = pressure_kPa;
    Solution solution = model_.solve(pressure_kPa, guess);
    if (solution.report.converged()) return solution;
  }
  if (start != nullptr) {
    Solution solution = model_.solve(pressure_kPa, start->state);
    if (solution.report.converged()) return solution;
  }
  return model_.solve(pressure_kPa);
}

MotionOutcome ElasticMotion::solve(size_t slot, std::span<const double> values, double pressure_kPa) {
  set_values(values);
  Solution solution = solve_from(nearest(slot, pressure_kPa), values, pressure_kPa);
  if (!solution.report.converged()) return {std::nullopt, solution.report.describe()};
  if (slots_.size() <= slot) slots_.resize(slot + 1);
  NodeField seen_mm = solution.state.position_mm;
  add_scaled(seen_mm, displacement_gain_ - 1.0, solution.state.position_mm);
  add_scaled(seen_mm, 1.0 - displacement_gain_, mesh().reference());
  slots_[slot] = Slot{{values.begin(), values.end()}, std::move(solution.state), std::nullopt};
  return {std::move(seen_mm), ""};
}

MotionDerivatives ElasticMotion::derivatives(size_t slot) {
  Slot& solved = slots_.at(slot).value();
  if (!solved.derivatives) {
    set_values(solved.values);
    Sensitivities by = model_.sensitivities(solved.state, groups_);
    solved.derivatives = MotionDerivatives{std::move(by.parameter), std::move(by.pressure)};
  }
  MotionDerivatives seen = *solved.derivatives;
  if (displacement_gain_ == 1.0) return seen;
  for (NodeField& field : seen.by_value)
    add_scaled(field, displacement_gain_ - 1.0, NodeField(field));
  add_scaled(seen.by_pressure, displacement_gain_ - 1.0, NodeField(seen.by_pressure));
  return seen;
}

}  // namespace diastole
