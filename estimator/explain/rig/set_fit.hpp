#pragma once
// The fit of one set of effects to a session's features, with its evidence.
//
// The effects' values, their moments and the modulus are searched; offsets and tolerances follow as linear unknowns, by
// columns taken at a known model. Values and the shares of the model's error are found in turn until the evidence rests.

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// From `start`, with the columns of `known`.
EffectSet fit_set(const rig::SessionProblem& problem, const rig::SessionModel& start,
                  const rig::LinearisedModel& known, const rig::Shares& shares);

}  // namespace diastole::explain
