#pragma once
// The images that guide points were set in: planes through each slice's points, short axis or long axis.
//
// Points that were clicked in three dimensions, or are written to whole millimetres, scatter across their image. Three quarters of a
// slice's points, at least, make a plane where that scatter (by their median distance) is no more than three of the errors that
// they state and a fifth of the slice's width: two images under one name do not, and a few points elsewhere hide no plane.

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "estimator/imaging/geometry/guide_points.hpp"

namespace diastole::imaging {

struct GuideSlice {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit; of either sign
  double scatter_mm = 0;                              ///< standard deviation of its points across the plane
  bool is_plane = false;
  size_t points = 0;  ///< without those of apex and base

  /// Normals within 45 degrees of the long axis.
  [[nodiscard]] bool is_short_axis(const Eigen::Vector3d& long_axis) const {
    return is_plane && std::abs(normal.dot(long_axis)) > std::sqrt(0.5);
  }
};

/// One for each slice of the guide points, from its points in all phases.
std::vector<GuideSlice> guide_slices(const GuidePoints& guide);

}  // namespace diastole::imaging
