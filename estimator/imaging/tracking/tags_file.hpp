#pragma once
// Tag points as NAME.tags.csv, which measurement.hpp reads.

#include <string>
#include <string_view>
#include <vector>

#include "estimator/imaging/tracking/tag_points.hpp"

namespace diastole::imaging {

/// What any file of tag points begins with.
inline constexpr std::string_view tags_file_mark = "frame,nx,ny,nz,plane_mm,x_mm,y_mm,z_mm,sigma_mm";

std::string tags_file_text(const std::vector<TrackedPoint>& points);

}  // namespace diastole::imaging
