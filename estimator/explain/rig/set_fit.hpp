#pragma once
// The fit of one set of effects to a session's features, with its evidence.
//
// The effects' values and the modulus are searched; moments stay where event_scan.hpp put them, and their errors are in the covariance; offsets and tolerances follow as linear unknowns, by
// columns taken at a known model, or are searched too. Values and the shares of the model's error are found in turn until
// the evidence rests.

#include <limits>

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// From `start`, with the columns of `known`. `best_so_far`: log posterior of the best set of all; one that is far from
/// it after a round is not searched further.
EffectSet fit_set(const rig::SessionProblem& problem, const rig::SessionModel& start,
                  const rig::LinearisedModel& known, const rig::Shares& shares,
                  double best_so_far = -std::numeric_limits<double>::infinity());

/// The same set again, with tolerances that are simulated: they need not be linear.
EffectSet fit_set_exactly(const rig::SessionProblem& problem, const EffectSet& near);

}  // namespace diastole::explain
