#include "estimator/imaging/geometry/slab_edges.hpp"

#include <algorithm>
#include <array>

#include "estimator/imaging/geometry/wall_map.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector3d;

/// From where an edge is seen to the wall in the slice's middle. `distance_mm`: of a place from the wall, positive outside.
Vector3d to_mid_slice(const SlicePlane& plane, const Vector3d& seen_mm, const auto& distance_mm) {
  constexpr size_t layers = 8;
  std::array<double, layers> distances_mm{};
  for (size_t k = 0; k < layers; ++k) {
    const double part = (static_cast<double>(k) + 0.5) / layers - 0.5;
    distances_mm[k] = distance_mm(seen_mm + part * plane.thickness_mm * plane.normal());
  }
  std::ranges::sort(distances_mm);
  const double median_mm = 0.5 * (distances_mm[layers / 2 - 1] + distances_mm[layers / 2]);
  const double here_mm = distance_mm(seen_mm);
  constexpr double step_mm = 0.1;
  const auto slope = [&](const Vector3d& direction) {
    return (distance_mm(seen_mm + step_mm * direction) - here_mm) / step_mm;
  };
  const Vector3d outwards =
      slope(plane.along_row) * plane.along_row + slope(plane.along_column) * plane.along_column;
  // A wall that lies in the plane, nearly, has no edge in it.
  constexpr double least_slope = 0.3;
  return (median_mm - here_mm) / std::max(outwards.squaredNorm(), least_slope * least_slope) * outwards;
}

}  // namespace

void move_to_mid_slice(GuidePoints& points, const VentricleFit& fit, const std::vector<SlicePlane>& planes) {
  std::vector<WallMap> maps;
  for (const VentricleWalls& walls : fit.phases)
    maps.emplace_back(fit.frame, walls);
  for (GuidePoint& point : points.points) {
    if (point.surface == GuideSurface::base) continue;
    const double side = is_inner(point.surface) ? -0.5 : 0.5;
    const auto distance_mm = [&](const Vector3d& seen_mm) {
      return maps[point.phase].distance_mm(side,
                                           fit.frame.inside(seen_mm - fit.shifts[point.slice].shift_mm));
    };
    point.place_mm += to_mid_slice(planes[point.slice], point.place_mm, distance_mm);
  }
}

}  // namespace diastole::imaging
