#pragma once
// A measured fibre field for ParaView: the wall in Bezier hexahedra with fibre vectors.

#include "estimator/imaging/diffusion/fibre_estimate.hpp"
#include "estimator/io/vtkhdf_file.hpp"

namespace diastole::imaging {

/// Point data fibre_direction (3), helix_deg, transverse_deg, sigma_deg; patient coordinates.
BezierGrid fibre_grid(const FibreEstimate& field);

}  // namespace diastole::imaging
