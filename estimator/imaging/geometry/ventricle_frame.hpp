#pragma once
// The long axis, centre and focus of a ventricle, from its guide points: an ellipsoid of revolution is fitted to both
// walls, whose axis starts as the line from the apex to the base.

#include <vector>

#include "estimator/imaging/geometry/guide_points.hpp"
#include "estimator/imaging/geometry/guide_slices.hpp"
#include "estimator/imaging/geometry/prolate_frame.hpp"

namespace diastole::imaging {

struct VentricleFrame {
  ProlateFrame frame;
  double inner_lambda = 0, outer_lambda = 0;  ///< of the two ellipsoids
};

/// Throws InputError when points of a wall are too few, or do not distinguish apex from base.
VentricleFrame ventricle_frame(const GuidePoints& guide, const std::vector<GuideSlice>& slices);

}  // namespace diastole::imaging
