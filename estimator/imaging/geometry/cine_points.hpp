#pragma once
// Guide points found in the cine images themselves: bright blood inside a darker wall, which differs from what is around it.
//
// From a centre in the blood rays go out in the image's plane; the inner wall is where the grey value falls through the mean of blood and
// wall, the outer where it leaves the wall's towards the surroundings', both between pixels and by what is seen on that ray, since coils
// shade images. A ray without a wall of 3 to 25 mm shows none, as above the base. The base is where the wall ends on the way up through its
// middle, in long-axis images. What thick slices displace is put back (slab_edges.hpp).
//
// Centres lie on the axis and follow the contours. Short-axis contours that are inclined by more than 27 degrees to
// the image mix depths over the slice's thickness and are left out; long-axis images show the apex.

#include "estimator/imaging/geometry/cines.hpp"
#include "estimator/imaging/geometry/guide_points.hpp"

namespace diastole::imaging {

/// Slices and phases are those of the cines. Throws InputError where no ventricle is seen in them.
GuidePoints cine_guide_points(const Cines& cines);

}  // namespace diastole::imaging
