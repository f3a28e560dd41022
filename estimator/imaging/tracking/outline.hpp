#pragma once
// The edge of tissue as closed curves, to be drawn and to be put right.

#include <Eigen/Dense>
#include <vector>

namespace diastole::imaging {

/// The curves depth = 0 of a depth map (materials.hpp), closed, in pixels (column, row), smoothed over three pixels; the image's border
/// closes what leaves it.
std::vector<std::vector<Eigen::Vector2d>> outlines_px(const Eigen::ArrayXXf& depth_mm);

}  // namespace diastole::imaging
