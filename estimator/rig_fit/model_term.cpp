#include "estimator/rig_fit/model_term.hpp"

#include <fmt/format.h>

#include <cmath>

namespace diastole::rig {

Unknown unknown_of(const Effect& effect, const EffectParameter& parameter) {
  constexpr double small = 1e-3;  // of a typical size: far above rounding, far below curvature
  Unknown unknown{{.name = fmt::format("{}.{}", effect.text().id, parameter.name),
                   .unit = std::string(parameter.unit),
                   .lower = parameter.lower,
                   .upper = parameter.upper,
                   .scale = parameter.scale}};
  const auto [lower, upper] = unknown.coordinate_bounds();
  const double size = std::abs(unknown.coordinate(parameter.typical) - unknown.coordinate(parameter.neutral));
  unknown.perturbation = small * (size == 0.0 ? 0.1 * (upper - lower) : size);
  unknown.sensors_only = effect.stage() == Stage::sensors;
  return unknown;
}

double sized_value(const EffectParameter& parameter, double neutral, double size) {
  const double from = inference::to_coordinate(parameter.scale, neutral);
  const double towards = inference::to_coordinate(parameter.scale, parameter.typical);
  return inference::from_coordinate(parameter.scale, from + size * (towards - from));
}

}  // namespace diastole::rig
