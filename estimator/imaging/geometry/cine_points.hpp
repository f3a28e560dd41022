#pragma once
// Guide points found in the cine images themselves: bright blood inside a darker wall, which differs from what is around it.
//
// Levels of blood, wall and surroundings are three classes of each slice's grey values. From a centre in the blood rays go out in
// the image's plane; the inner wall is where the grey value falls through the mean of blood and wall, the outer where it leaves the
// wall's towards the surroundings', both between pixels. A ray without a wall of 3 to 25 mm shows none, as above the base. The base is where
// the wall ends on the way up through its middle, in long-axis images.
//
// Centres lie on the axis, in which the long-axis images meet, and follow the contours. Short-axis contours that are inclined by more than 27 degrees to
// the image mix depths over the slice's thickness and are left out; long-axis images show the apex.

#include <filesystem>
#include <functional>
#include <string>

#include "estimator/imaging/geometry/guide_points.hpp"

namespace diastole::imaging {

/// Phases are numbered by trigger time from 0, short-axis slices sa00 (apical) upwards, long-axis slices la0 upwards. Throws InputError where
/// the folder has no cines, or no ventricle is seen in them.
GuidePoints cine_guide_points(const std::filesystem::path& folder,
                              const std::function<void(const std::string&)>& on_stage = {});

}  // namespace diastole::imaging
