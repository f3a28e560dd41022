#pragma once
// When did it happen? The moments of an effect that begins at some (a sensor's step, steps lost), from what a set of
// effects leaves of a session's features.
//
// The effect is simulated once, there from the start of each run; what it does from a moment on is taken to be that
// change from then on. Features hold a cycle's level and size, so that a moment is found to within half a cycle. Moments
// are added one by one, all of one size, where they promise most, as long as each gains more than its choice among so
// many moments may bring by chance.

#include <optional>

#include "estimator/explain/rig/effect_sets.hpp"

namespace diastole::explain {

/// A model from which a fit may start; none if no moment gains enough.
std::optional<rig::SessionModel> scan_events(const rig::SessionProblem& problem, const EffectSet& before,
                                             const Effect& effect);

}  // namespace diastole::explain
