#pragma once
// The finite-element model as the fit's motion model: values go to the law's parameters of all elements or of
// one, and every frame starts from its own last equilibrium, moved along the exact sensitivities. Frames that have one are solved
// at the same time, each by a thread of its own; a frame's result does not depend on which.

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fit/considered_errors.hpp"
#include "estimator/fit/motion_model.hpp"

namespace diastole {

class ElasticMotion : public MotionModel {
 public:
  /// `groups[i]` says which parameter of which elements value i sets.
  ElasticMotion(ElasticModel model, std::vector<ParameterGroup> groups)
      : model_(std::move(model)), groups_(std::move(groups)) {}

  [[nodiscard]] const HermiteMesh& mesh() const override { return model_.mesh(); }
  [[nodiscard]] MotionOutcome solve(size_t slot, std::span<const double> values,
                                    double pressure_kPa) override;
  [[nodiscard]] MotionDerivatives derivatives(size_t slot) override;
  [[nodiscard]] std::vector<MotionOutcome> solve_all(std::span<const double> values,
                                                     std::span<const double> pressures_kPa) override;
  void prepare_derivatives() override;
  [[nodiscard]] std::vector<ConsideredMotion> considered(size_t slot) override;
  /// constrained_energy.hpp.
  [[nodiscard]] EnergyDerivatives energy_derivatives(size_t slot) override;
  [[nodiscard]] double stored_energy_mJ(size_t slot) override;

  /// Precondition: images show the motion itself.
  void consider(std::vector<ConsideredError> errors) { considered_ = std::move(errors); }

  [[nodiscard]] const ElasticModel& model() const { return model_; }

  /// Frames begin at the solutions that another motion of the same mesh has reached.
  void begin_at(const ElasticMotion& other);

 protected:
  /// Makes the model that of these values; why not, if there is none.
  virtual std::optional<std::string> set_values(std::span<const double> values);
  /// At an equilibrium of the model as it stands.
  virtual MotionDerivatives derivatives_at(const ElasticState& state);
  /// At an equilibrium of the model as it stands: stored since frame 0, and its derivatives, those of the motion being given.
  [[nodiscard]] virtual double stored_at(const ElasticState& state) const {
    return model_.stored_energy_mJ(state) - model_.stored_energy_mJ(model_.rest_state());
  }
  virtual EnergyDerivatives energy_derivatives_at(const ElasticState& state, std::span<const double> values,
                                                  const MotionDerivatives& by);
  /// For differences by a value, on each side.
  static double step_of(double value) { return value != 0 ? 1e-4 * std::abs(value) : 1e-4; }
  /// Whether a frame's motion is that of the model with these values, at its pressure, and nothing else.
  [[nodiscard]] virtual bool frames_are_independent() const { return true; }
  /// Where a frame begins that has no earlier solution.
  [[nodiscard]] virtual ElasticState first_state() const { return model_.rest_state(); }

  /// Of the slot's last successful `solve`.
  [[nodiscard]] const ElasticState& state(size_t slot) const { return slots_.at(slot).value().state; }
  [[nodiscard]] ElasticModel& changed_model() { return model_; }
  [[nodiscard]] const std::vector<ParameterGroup>& groups() const { return groups_; }
  static void set_values(ElasticModel& model, const std::vector<ParameterGroup>& groups,
                         std::span<const double> values);

 private:
  struct Slot {
    std::vector<double> values;
    ElasticState state;
    std::optional<MotionDerivatives> derivatives;   // at `values` and the state's pressure
    std::shared_ptr<const CondensedFactor> factor;  // of the last tangent that derivatives were made with
  };

  /// Of the tangent that derivatives were made with; none where all slots' would take too much memory.
  [[nodiscard]] std::shared_ptr<const CondensedFactor> factor_to_keep(const ElasticModel& body) const;
  [[nodiscard]] const Slot* nearest(size_t slot, double pressure_kPa) const;
  /// By a body that has the values.
  [[nodiscard]] MotionOutcome solve(ElasticModel& body, size_t slot, std::span<const double> values,
                                    double pressure_kPa);
  [[nodiscard]] Solution solve_from(ElasticModel& body, const Slot* start, std::span<const double> values,
                                    double pressure_kPa);
  /// Calls work(body, i) for 0 <= i < count, on as many threads as the machine has, each with a body of its own, which work gives its
  /// values.
  void share(size_t count, const std::function<void(ElasticModel& body, size_t i)>& work);

  ElasticModel model_;
  std::vector<ElasticModel> bodies_;  // copies of it, one a thread
  std::vector<ParameterGroup> groups_;
  std::vector<ConsideredError> considered_;
  std::vector<std::optional<Slot>> slots_;
};

}  // namespace diastole
