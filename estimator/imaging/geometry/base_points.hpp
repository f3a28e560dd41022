#pragma once
// Points of the plane that closes a ventricle at its base.

#include <vector>

#include "estimator/imaging/geometry/guide_points.hpp"
#include "estimator/imaging/geometry/guide_slices.hpp"
#include "estimator/imaging/geometry/prolate_frame.hpp"

namespace diastole::imaging {

/// The guide points, which hold points of the base in the end: where the file has none they are put on the most basal
/// short-axis slice that shows the endocardium in all phases, and a finding says so. Throws InputError if there is no such
/// slice, or if the file's points of the base make no plane.
GuidePoints with_base(const GuidePoints& guide, const std::vector<GuideSlice>& slices,
                      const ProlateFrame& frame, std::vector<Finding>& findings);

}  // namespace diastole::imaging
