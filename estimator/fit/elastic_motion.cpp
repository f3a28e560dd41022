#include "estimator/fit/elastic_motion.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "estimator/fit/constrained_energy.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

constexpr size_t most_entries_kept = 100'000'000;  // of all slots' factors: 0.8 GB

MotionDerivatives derivatives_of(Sensitivities by) {
  return {std::move(by.parameter), std::move(by.pressure)};
}

}  // namespace

void ElasticMotion::set_values(ElasticModel& model, const std::vector<ParameterGroup>& groups,
                               std::span<const double> values) {
  for (size_t i = 0; i < groups.size(); ++i) {
    const ParameterGroup& group = groups[i];
    if (group.elements.empty()) {
      model.set_parameter(group.parameter, values[i]);
    } else {
      for (const size_t element : group.elements)
        model.set_element_parameter(group.parameter, element, values[i]);
    }
  }
}

std::optional<std::string> ElasticMotion::set_values(std::span<const double> values) {
  set_values(model_, groups_, values);
  return {};
}

MotionDerivatives ElasticMotion::derivatives_at(const ElasticState& state) {
  return derivatives_of(model_.sensitivities(state, groups_));
}

std::shared_ptr<const CondensedFactor> ElasticMotion::factor_to_keep(const ElasticModel& body) const {
  const bool fit_in = slots_.size() * body.system().factor_entries() <= most_entries_kept;
  return fit_in ? body.system().kept_factor() : nullptr;
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

Solution ElasticMotion::solve_from(ElasticModel& body, const Slot* start, std::span<const double> values,
                                   double pressure_kPa) {
  std::shared_ptr<const CondensedFactor> factor =
      start != nullptr && start->factor ? start->factor : body.system().kept_factor();
  if (start != nullptr && start->derivatives) {
    ElasticState guess = start->state;
    add_scaled(guess.position_mm, pressure_kPa - guess.pressure_kPa, start->derivatives->by_pressure);
    for (size_t i = 0; i < values.size(); ++i) {
      add_scaled(guess.position_mm, values[i] - start->values[i], start->derivatives->by_value[i]);
    }
    guess.pressure_kPa = pressure_kPa;
    Solution solution = body.solve({pressure_kPa, guess.fibre_tension_kPa}, guess, factor);
    if (solution.report.converged()) return solution;
  }
  if (start != nullptr) {
    Solution solution =
        body.solve({pressure_kPa, start->state.fibre_tension_kPa}, start->state, std::move(factor));
    if (solution.report.converged()) return solution;
  }
  return body.solve(pressure_kPa, first_state());
}

void ElasticMotion::begin_at(const ElasticMotion& other) {
  slots_ = other.slots_;
  for (std::optional<Slot>& slot : slots_)
    if (slot) slot->derivatives.reset();
}

MotionOutcome ElasticMotion::solve(size_t slot, std::span<const double> values, double pressure_kPa) {
  if (std::optional<std::string> reason = set_values(values)) return {std::nullopt, *std::move(reason)};
  return solve(model_, slot, values, pressure_kPa);
}

MotionOutcome ElasticMotion::solve(ElasticModel& body, size_t slot, std::span<const double> values,
                                   double pressure_kPa) {
  Solution solution = solve_from(body, nearest(slot, pressure_kPa), values, pressure_kPa);
  if (!solution.report.converged()) return {std::nullopt, solution.report.describe()};
  if (slots_.size() <= slot) slots_.resize(slot + 1);
  NodeField position_mm = solution.state.position_mm;
  std::shared_ptr<const CondensedFactor> factor = slots_[slot] ? slots_[slot]->factor : nullptr;
  slots_[slot] =
      Slot{{values.begin(), values.end()}, std::move(solution.state), std::nullopt, std::move(factor)};
  return {std::move(position_mm), ""};
}

MotionDerivatives ElasticMotion::derivatives(size_t slot) {
  Slot& solved = slots_.at(slot).value();
  if (!solved.derivatives) {
    (void)set_values(solved.values);
    solved.derivatives = derivatives_at(solved.state);
    solved.factor = factor_to_keep(model_);
  }
  return *solved.derivatives;
}

void ElasticMotion::share(size_t count, const std::function<void(ElasticModel& body, size_t i)>& work) {
  const size_t threads = std::min(count, machine_threads());
  if (threads == 1) {
    for (size_t i = 0; i < count; ++i)
      work(model_, i);
    return;
  }
  while (bodies_.size() < threads) {
    bodies_.push_back(model_);
    bodies_.back().system().set_threads(1);
  }
  std::atomic<size_t> next{0};
  parallel_for(threads, threads, [&](size_t thread) {
    for (size_t i = next++; i < count; i = next++)
      work(bodies_[thread], i);
  });
}

std::vector<MotionOutcome> ElasticMotion::solve_all(std::span<const double> values,
                                                    std::span<const double> pressures_kPa) {
  // A frame without a factor of its own would begin with the last one that its body used.
  const bool have_factors =
      slots_.size() == pressures_kPa.size() &&
      std::ranges::all_of(slots_, [](const auto& slot) { return slot && slot->factor; });
  if (!have_factors || !frames_are_independent()) return MotionModel::solve_all(values, pressures_kPa);
  set_values(model_, groups_, values);
  std::vector<MotionOutcome> outcomes(pressures_kPa.size());
  share(outcomes.size(), [&](ElasticModel& body, size_t slot) {
    set_values(body, groups_, values);
    outcomes[slot] = solve(body, slot, values, pressures_kPa[slot]);
  });
  return outcomes;
}

void ElasticMotion::prepare_derivatives() {
  // MUMPS, which factorises what cannot be condensed, is used by one thread at a time.
  if (!frames_are_independent() || !model_.system().kept_factor()) return;
  std::vector<Slot*> without;
  for (std::optional<Slot>& slot : slots_)
    if (slot && !slot->derivatives) without.push_back(&*slot);
  share(without.size(), [&](ElasticModel& body, size_t i) {
    Slot& slot = *without[i];
    set_values(body, groups_, slot.values);
    slot.derivatives = derivatives_of(body.sensitivities(slot.state, groups_));
    slot.factor = factor_to_keep(body);
  });
}

double ElasticMotion::stored_energy_mJ(size_t slot) {
  const Slot& solved = slots_.at(slot).value();
  (void)set_values(solved.values);
  return stored_at(solved.state);
}

EnergyDerivatives ElasticMotion::energy_derivatives(size_t slot) {
  (void)derivatives(slot);
  const Slot& solved = slots_.at(slot).value();
  (void)set_values(solved.values);
  return energy_derivatives_at(solved.state, solved.values, *solved.derivatives);
}

EnergyDerivatives ElasticMotion::energy_derivatives_at(const ElasticState& state,
                                                       std::span<const double> values,
                                                       const MotionDerivatives& by) {
  EnergyDerivatives result;
  for (size_t i = 0; i < values.size(); ++i) {
    std::vector<double> changed(values.begin(), values.end());
    const double change = step_of(values[i]);
    const auto stored_mJ = [&](double value) {
      changed[i] = value;
      set_values(model_, groups_, changed);
      return stored_at(state);
    };
    result.by_value.push_back((stored_mJ(values[i] + change) - stored_mJ(values[i] - change)) / (2 * change) +
                              pressure_work_mJ(model_, state, by.by_value[i]));
  }
  set_values(model_, groups_, values);
  result.by_pressure = pressure_work_mJ(model_, state, by.by_pressure);
  return result;
}

std::vector<ConsideredMotion> ElasticMotion::considered(size_t slot) {
  if (considered_.empty()) return {};
  const Slot& solved = slots_.at(slot).value();
  (void)set_values(solved.values);
  return considered_motions(model_, solved.state, considered_);
}

}  // namespace diastole
