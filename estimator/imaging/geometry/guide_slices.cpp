#include "estimator/imaging/geometry/guide_slices.hpp"

#include <algorithm>

namespace diastole::imaging {
namespace {

/// Points of one image are apart from its plane by what the file's decimals round away.
constexpr double out_of_plane_mm = 0.05;

bool is_landmark(GuideSurface surface) { return is_apex(surface) || surface == GuideSurface::base; }

}  // namespace

std::vector<GuideSlice> guide_slices(const GuidePoints& guide) {
  std::vector<GuideSlice> slices(guide.slices.size());
  // A click at an apex or at the base may show where it is thought to be, beside the image's plane.
  for (const GuidePoint& point : guide.points) {
    if (is_landmark(point.surface)) continue;
    slices[point.slice].centre_mm += point.place_mm;
    ++slices[point.slice].points;
  }
  std::vector<Eigen::Matrix3d> spread(slices.size(), Eigen::Matrix3d::Zero());
  for (GuideSlice& slice : slices)
    slice.centre_mm /= std::max(1.0, static_cast<double>(slice.points));
  for (const GuidePoint& point : guide.points) {
    if (is_landmark(point.surface)) continue;
    const Eigen::Vector3d from_centre = point.place_mm - slices[point.slice].centre_mm;
    spread[point.slice] +=
        from_centre * from_centre.transpose() / static_cast<double>(slices[point.slice].points);
  }
  for (size_t s = 0; s < slices.size(); ++s) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread[s]);
    slices[s].normal = axes.eigenvectors().col(0);
    // Four points at least, spread in two directions: three are always in a plane.
    slices[s].is_plane = slices[s].points > 3 && axes.eigenvalues()[0] < out_of_plane_mm * out_of_plane_mm &&
                         axes.eigenvalues()[1] > 100 * out_of_plane_mm * out_of_plane_mm;
  }
  return slices;
}

}  // namespace diastole::imaging
