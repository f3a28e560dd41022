#pragma once
// A set judged by a part of it that was fitted already, which saves a fit of its own where linear algebra suffices.

#include <optional>
#include <span>
#include <vector>

#include "estimator/explain/rig/effect_sets.hpp"

namespace diastole::explain {

/// The log posterior of a set of which a part was fitted exactly and explains more, by linear algebra there: what it lacks at its
/// best sizes, which are its priors' sds, too. None if that promises more than its prior odds cost.
std::optional<double> posterior_by_part(const EffectSet& set, std::span<const EffectSet> fitted,
                                        const std::vector<Response>& responses);

}  // namespace diastole::explain
