#pragma once
// The volume of a body.

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// Where its nodes are at `position_mm`.
double volume_mm3(const HermiteMesh& mesh, const NodeField& position_mm);

}  // namespace diastole
