#pragma once
// What a rig's description does not state exactly: lengths, losses, lags, gains, a gel's few per cent of relaxation.
//
// Each is an unknown of every fit, with a prior: its offset from what /rig states is normal about zero with the sd of
// the list in tolerance.cpp, whose sizes are those of the parts' data sheets and of the labs' own rigs. An effect is a
// departure beyond them. Coordinates u are offsets over their sds.

#include <span>
#include <string_view>

#include "estimator/effects/effect.hpp"
#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

/// When a tolerance is an unknown of a session whose rig does not state its size: elsewhere it is freedom that hides more than it
/// mends.
enum class IsUnknown {
  always,
  with_references,  ///< whatever they say of it
  where_learnt      ///< where they say more of it than the list
};

struct Tolerance {
  std::string_view name;
  std::string_view unit;  ///< of the offset; "ln" for the logarithm of a factor
  double sd = 0.0;
  bool sensors_only = false;      ///< the plant does not depend on it
  bool needs_neighbours = false;  ///< only a specimen with computed neighbours can have it
  void (*apply)(double offset, const EffectContext&, RigModel&) = nullptr;
  IsUnknown is_unknown = IsUnknown::always;
};

/// They keep their order: references store them by name.
std::span<const Tolerance> all_tolerances();

}  // namespace diastole::rig
