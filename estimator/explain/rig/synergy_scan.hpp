#pragma once
// Effects that only show together: a throttle changes little on a stiff hose, and a soft hose without one rings, so that what
// each does alone says nothing of both. Pairs that effects declare (EffectDeclaration::synergies) are simulated at several
// sizes of both, with the modulus that was declared and the one that fits without them.

#include <vector>

#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// Does either declare that it only shows with the other?
bool only_show_together(const Effect& one, const Effect& other);

/// For each pair the model of the largest evidence, from which a fit may start; the most probable pair first. None of a pair
/// that no simulation of could be made. `declared`: the model without them.
std::vector<rig::SessionModel> scan_synergies(const rig::SessionProblem& problem,
                                              const rig::LinearisedModel& declared);

}  // namespace diastole::explain
