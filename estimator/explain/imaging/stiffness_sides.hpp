#pragma once
// How forces answer to the stiffness: right-hand sides for a body's tangent.

#include <array>
#include <vector>

#include "estimator/fe/elastic_system.hpp"

namespace diastole::explain {

/// Numbers at the Gauss points of each element.
using GaussNumbers = std::vector<std::array<double, gauss_points>>;

/// The field's values at the Gauss points.
GaussNumbers at_gauss_points(const HermiteMesh& mesh, const StiffnessField& field);

/// - dR/dc for C1(X) (1 + c field(X)), one for each field, over the system's unknowns. Precondition: the law's first
/// parameter is C1, and its energy proportional to it.
std::vector<std::vector<double>> stiffness_sides(const ElasticSystem& system, const ElasticState& state,
                                                 const std::vector<GaussNumbers>& fields);

}  // namespace diastole::explain
