#pragma once
// The motion of a body with field effects (estimator/effects/field_model.hpp), as images of it show it:
//
//   x_seen = X + gain (x(P - offset) - x(0)) + P motion
//
// with x the equilibrium of the changed body and x(0) the same without load: X, but for residual stress. Some of the effects' values may
// be unknowns beside the law's:
//
//   dx/dm = - K^-1 (R(x; m + h) - R(x; m - h)) / 2h

#include <functional>
#include <vector>

#include "estimator/effects/field_model.hpp"
#include "estimator/fit/elastic_motion.hpp"

namespace diastole {

/// What a body is for the effects' values.
struct BodyChanges {
  std::function<ElasticModel(const FieldModel& change)> body;
  /// Of the values that are unknown.
  std::function<FieldModel(std::span<const double> unknown)> change;
  /// Half the distance for differences, one an unknown.
  std::vector<double> steps = {};
};

class ChangedMotion : public ElasticMotion {
 public:
  /// Values: those of `groups`, then the changes' unknowns, which start at `start`.
  ChangedMotion(BodyChanges changes, std::vector<ParameterGroup> groups, std::vector<double> start);

  [[nodiscard]] MotionOutcome solve(size_t slot, std::span<const double> values,
                                    double pressure_kPa) override;
  [[nodiscard]] MotionDerivatives derivatives(size_t slot) override;

  /// Derivatives of the seen motion by other changes than the unknown ones, at the slot's solution: (up - down) / width.
  struct Perturbation {
    FieldModel up, down;
    double width;
  };
  [[nodiscard]] std::vector<NodeField> by_changes(size_t slot, const std::vector<Perturbation>& changes);

  /// The body at a slot's solution, its tangent factorised there, and the solution.
  struct Equilibrium {
    ElasticModel& body;
    const ElasticState& state;
  };
  [[nodiscard]] Equilibrium equilibrium(size_t slot) { return equilibrium_at(slot_of(slot)); }

 protected:
  std::optional<std::string> set_values(std::span<const double> values) override;
  MotionDerivatives derivatives_at(const ElasticState& state) override;
  [[nodiscard]] bool frames_are_independent() const override { return false; }

 private:
  [[nodiscard]] Equilibrium equilibrium_at(size_t own_slot);
  [[nodiscard]] std::span<const double> unknown(std::span<const double> values) const {
    return values.subspan(groups().size());
  }
  [[nodiscard]] Perturbation perturbation(size_t unknown, std::span<const double> at) const;
  /// - (R(up) - R(down)) / width over the unknowns; zero where the body is the same.
  [[nodiscard]] std::vector<double> right_side(const Perturbation& change, const ElasticState& state) const;
  /// Adds what a change does beside moving the body, `by_motion` being by the motion.
  void add_seen(size_t slot, const Perturbation& change, const NodeField& by_pressure, NodeField& by) const;
  // Slots of the motion without load and of the frames.
  static constexpr size_t rest_slot = 0;
  static constexpr size_t slot_of(size_t frame) { return 1 + frame; }
  /// The solution less that without load.
  [[nodiscard]] NodeField displacement_mm(size_t slot) const;

  BodyChanges changes_;
  std::vector<double> pressures_kPa_;  // as read, of the frames' last solutions
  FieldModel change_;
  std::vector<double> law_values_;
  std::vector<double> unknown_;
  bool from_rest_;  ///< whether the body without load may be another than X
};

}  // namespace diastole
