#pragma once
// From one equilibrium to that of another load (cavity pressure or volume, fibre tension, the pressure that the
// chamber around the specimen was sealed at) in adaptive load steps: the
// whole way at once if Newton's method takes it, else by halves; steps grow again after easy ones, and start
// from the line through the last two equilibria.

#include "estimator/fe/elastic_system.hpp"

namespace diastole {

/// `start` need not be an equilibrium (parameters may have changed since): it is brought into one first when
/// the load stays. The first step tries the factor of a tangent near by, if there is one.
/// Precondition: start is of this system and not inverted.
Solution follow_load(ElasticSystem& system, const ElasticState& start, const Load& load,
                     const SolveOptions& options, std::shared_ptr<const CondensedFactor> near_by = {});

}  // namespace diastole
