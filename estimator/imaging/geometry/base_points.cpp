#include "estimator/imaging/geometry/base_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector3d;

/// The number of the slice.
size_t top_slice(const GuidePoints& guide, const std::vector<GuideSlice>& slices, const ProlateFrame& frame) {
  std::vector<std::set<size_t>> phases(slices.size());
  for (const GuidePoint& point : guide.points)
    if (point.surface == GuideSurface::endo) phases[point.slice].insert(point.phase);
  size_t top = slices.size();
  double height = -std::numeric_limits<double>::infinity();
  for (size_t s = 0; s < slices.size(); ++s) {
    const double z = frame.inside(slices[s].centre_mm).z();
    if (!slices[s].is_short_axis(frame.axes.col(2)) || phases[s].size() < guide.phases.size() || z <= height)
      continue;
    top = s;
    height = z;
  }
  if (top == slices.size())
    throw InputError({guide.file, "", "has neither points of the base nor a short-axis slice in all phases",
                      "Set points of the surface base where the ventricle ends, three at least."});
  return top;
}

void require_plane(const GuidePoints& guide, const ProlateFrame& frame) {
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
  size_t count = 0;
  for (const GuidePoint& point : guide.points) {
    if (point.surface != GuideSurface::base) continue;
    const Vector3d x = frame.inside(point.place_mm);
    const Vector3d row(1, x.x() / frame.focus_mm, x.y() / frame.focus_mm);
    square += row * row.transpose();
    ++count;
  }
  // On one line, a tenth of the focus wide, they leave a tilt unknown.
  const double spread =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(square).eigenvalues()[0] / static_cast<double>(count);
  if (count >= 3 && spread > 1e-3) return;
  throw InputError(
      {guide.file, "", fmt::format("the {} points of the base make no plane", count),
       "Set three or more on different sides of the ventricle, in two long-axis images or more."});
}

}  // namespace

GuidePoints with_base(const GuidePoints& guide, const std::vector<GuideSlice>& slices,
                      const ProlateFrame& frame, std::vector<Finding>& findings) {
  const bool has_base = std::any_of(guide.points.begin(), guide.points.end(), [](const GuidePoint& point) {
    return point.surface == GuideSurface::base;
  });
  if (has_base) {
    require_plane(guide, frame);
    return guide;
  }
  const size_t top = top_slice(guide, slices, frame);
  findings.push_back(
      {Severity::warning, "no-base",
       fmt::format("no point of the base is given: the mesh ends at slice {}", guide.slices[top]), guide.file,
       frame.inside(slices[top].centre_mm).z(), "mm", "Set points of the surface base in long-axis images."});
  GuidePoints closed = guide;
  // The slice's own contour lies in the plane and, as points of the base, holds it there.
  for (const GuidePoint& point : guide.points) {
    if (point.slice != top || point.surface != GuideSurface::endo) continue;
    closed.points.push_back(point);
    closed.points.back().surface = GuideSurface::base;
  }
  return closed;
}

}  // namespace diastole::imaging
