#pragma once
// Points that no ventricle passes, such as one whose decimal point was lost: they would turn the axis and the size that everything else
// starts from, and are left out.
//
// A wall is near an ellipsoid, |x|^2 = a + b.x + x'Qx (trace Q = 0), fitted by iterated weights (Cauchy) that fall with the distance from
// it and from the wall's middle. Beside it by eight times the median distance, and by half of the wall's size, lies no wall.

#include <vector>

#include "estimator/imaging/geometry/guide_points.hpp"

namespace diastole::imaging {

/// The points without the wild ones, each of which is named. Where they are more than a fifth of a wall they are no errors of single
/// points, and all stay.
GuidePoints without_wild_points(const GuidePoints& guide, std::vector<Finding>& findings);

}  // namespace diastole::imaging
