#pragma once
// An effect in a model, and the unknowns that it brings.

#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/inference/parameter_space.hpp"

namespace diastole::rig {

/// An effect that the model has, and the change points found for it.
struct ModelTerm {
  const Effect* effect = nullptr;
  std::vector<ChangePoint> change_points = {};
};

/// "hose-compliance.wave_speed_m_s"
struct Unknown : inference::Parameter {
  double perturbation = 0.0;  ///< of the coordinate, for differences
  bool sensors_only = false;  ///< the plant does not depend on it

  /// The perturbation, its sign so that the coordinate stays within the bounds.
  [[nodiscard]] double step_from(double coordinate) const {
    return coordinate + perturbation > coordinate_bounds()[1] ? -perturbation : perturbation;
  }
};
Unknown unknown_of(const Effect& effect, const EffectParameter& parameter);
/// The value at `size` of the way from `neutral` to the parameter's typical value, in its search coordinate.
double sized_value(const EffectParameter& parameter, double neutral, double size);

}  // namespace diastole::rig
