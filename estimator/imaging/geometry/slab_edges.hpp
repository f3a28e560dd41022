#pragma once
// What a thick slice makes of a wall: an edge in its image is where half of the thickness lies to either side of the wall.
//
// A wall that is round across the slice is therefore seen inside its place in the slice's middle (by thickness^2 * curvature
// across / 32: 0.2 mm for 8 mm and a radius of 10 mm), one that is inclined and flat is not. Neighbours and phases err alike by it.

#include <vector>

#include "estimator/imaging/dicom/slice_plane.hpp"
#include "estimator/imaging/geometry/guide_points.hpp"
#include "estimator/imaging/geometry/ventricle_fit.hpp"

namespace diastole::imaging {

/// Moves points on walls, in their planes, from where their edges are seen to where the wall is in the slice's middle. `fit`: of these
/// points; its walls' curvatures and slopes count, not their places. `planes`: of the points' slices.
void move_to_mid_slice(GuidePoints& points, const VentricleFit& fit, const std::vector<SlicePlane>& planes);

}  // namespace diastole::imaging
