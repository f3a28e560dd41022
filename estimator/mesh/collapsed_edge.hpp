#pragma once
// Places where an element has no volume about it, as on the axis of a closed apex: there the wall has no directions.

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// Whether the undeformed element's tangents at a point span less than this part of their length cubed.
bool is_collapsed(const HermiteMesh& mesh, const MaterialPoint& point, double least_relative_volume = 1e-6);

/// The point itself, or where it is collapsed one so far (in xi) within its element.
MaterialPoint beside_collapse(const HermiteMesh& mesh, MaterialPoint point, double beside);

}  // namespace diastole
