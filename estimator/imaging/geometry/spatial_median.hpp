#pragma once
// The place whose summed distance from all points is least (Weiszfeld's iteration). It lies in the plane of points that lie in
// one, and hardly moves for a few that are far from all others.

#include <Eigen/Dense>
#include <vector>

namespace diastole::imaging {

/// Precondition: at least one point.
inline Eigen::Vector3d spatial_median(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points)
    median += point / static_cast<double>(points.size());
  for (int i = 0; i < 50; ++i) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const Eigen::Vector3d& point : points) {
      const double weight = 1 / std::max(1e-9, (point - median).norm());
      sum += weight * point;
      weights += weight;
    }
    median = sum / weights;
  }
  return median;
}

}  // namespace diastole::imaging
