#pragma once
// How forces answer to the stiffness: right-hand sides for a body's tangent.

#include <vector>

#include "estimator/fe/elastic_system.hpp"

namespace diastole::explain {

/// - dR/dc for C1(X) (1 + c field(X)), one for each field, over the system's unknowns. Precondition: the law's first
/// parameter is C1, and its energy proportional to it.
std::vector<std::vector<double>> stiffness_sides(const ElasticSystem& system, const ElasticState& state,
                                                 const std::vector<StiffnessField>& fields);

}  // namespace diastole::explain
