#pragma once
// What every effect must keep, built in or a user's file: tried on a short simulated session of a gel (three runs, the
// model itself with noise), so that data and estimates share one model: it is the declaration that is tried, not physics.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/rig/simulation.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {

struct EffectCheck {
  std::string name;  ///< "neutral value"
  bool passed = false;
  std::string detail;    ///< what was seen, with figures
  bool is_open = false;  ///< passed, since these data decide nothing
  [[nodiscard]] std::string_view outcome() const { return !passed ? "FAILED" : is_open ? "open" : "passed"; }
};

class EffectTrial {
 public:
  /// Precondition: the effect shows in recordings of the rig. It must outlive the trial.
  explicit EffectTrial(const Effect& effect, size_t threads = 2);

  /// All texts are there, values are within their bounds.
  [[nodiscard]] EffectCheck declared() const;
  /// The base model exactly: with all parameters neutral, and with the sizes alone (is_amplitude).
  [[nodiscard]] EffectCheck neutral() const;
  /// It changes a pressure by 5 Pa or more where it is typical.
  [[nodiscard]] EffectCheck shows() const;
  /// Pressures are finite at both bounds of every parameter, the others typical.
  [[nodiscard]] EffectCheck bounded() const;
  /// The fit's difference is the slope, within a twentieth.
  [[nodiscard]] EffectCheck differentiable() const;
  /// A search finds its size, with an error below half of it, in data that were made with it, or parameters that these data cannot
  /// distinguish from it: they change the pressures alike, to a tenth.
  [[nodiscard]] EffectCheck found_again() const;
  /// A search prefers the model without it in data that were made without.
  [[nodiscard]] EffectCheck silent() const;

  /// All of them in this order; `progress` gets each one's name.
  [[nodiscard]] std::vector<EffectCheck> all(const std::function<void(const std::string&)>& progress) const;

 private:
  [[nodiscard]] rig::Prediction predicted(const std::optional<std::vector<double>>& values) const;
  [[nodiscard]] EffectSet fitted_without(const rig::SessionProblem& problem) const;
  [[nodiscard]] EffectSet fitted_with(const rig::SessionProblem& problem) const;

  const Effect& effect_;
  size_t threads_;
  rig::SpecimenFamily family_;
  rig::SessionRun run_;
  std::vector<ChangePoint> change_points_;
  std::vector<double> neutral_, typical_;
};

}  // namespace diastole::explain
