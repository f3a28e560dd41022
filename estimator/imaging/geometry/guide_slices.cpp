#include "estimator/imaging/geometry/guide_slices.hpp"

#include <algorithm>

#include "estimator/imaging/geometry/spatial_median.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// What a file's decimals round away is no scatter, whatever error its points state.
constexpr double rounding_mm = 0.05;
constexpr double most_sigmas_across = 3;
constexpr double least_widths = 5;

bool is_landmark(GuideSurface surface) { return is_apex(surface) || surface == GuideSurface::base; }

struct Plane {
  Vector3d centre_mm, normal;
  double width_mm;  ///< standard deviation of its points in the direction in which they spread less
  size_t points;    ///< that it was laid through

  [[nodiscard]] double distance_mm(const Vector3d& place_mm) const {
    return std::abs(normal.dot(place_mm - centre_mm));
  }
};

Plane plane_of(const Vector3d& centre_mm, const Matrix3d& spread, size_t points) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(spread);
  return {centre_mm, axes.eigenvectors().col(0), std::sqrt(std::max(0.0, axes.eigenvalues()[1])), points};
}

Plane plane_through(const std::vector<Vector3d>& places) {
  const auto count = static_cast<double>(places.size());
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& place : places)
    centre += place / count;
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& place : places)
    spread += (place - centre) * (place - centre).transpose() / count;
  return plane_of(centre, spread, places.size());
}

/// By directions from the middle alone: a point far away counts no more than one nearby.
Plane plane_of_directions(const std::vector<Vector3d>& places) {
  const Vector3d middle = spatial_median(places);
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& place : places) {
    const Vector3d direction = (place - middle).normalized();
    spread += direction * direction.transpose();
  }
  return plane_of(middle, spread, places.size());
}

double scatter_about(const Plane& plane, const std::vector<Vector3d>& places) {
  std::vector<double> distances;
  for (const Vector3d& place : places)
    distances.push_back(plane.distance_mm(place));
  return signal::deviation_of_normal(std::move(distances));
}

/// Of fewer than eight points a part would always lie near some plane.
size_t most_of(size_t points) { return points < 8 ? points : points - points / 4; }
size_t half_of(size_t points) { return points < 8 ? points : (points + 4) / 2; }

/// Through the nearest half (least trimmed squares), and then through all that scatter may have moved so far.
Plane plane_of_most(std::vector<Vector3d> places, double most_mm) {
  Plane plane = plane_of_directions(places);
  const size_t kept = half_of(places.size());
  for (int i = 0; i < 10; ++i) {
    std::sort(places.begin(), places.end(), [&](const Vector3d& a, const Vector3d& b) {
      return plane.distance_mm(a) < plane.distance_mm(b);
    });
    plane = plane_through({places.begin(), places.begin() + static_cast<std::ptrdiff_t>(kept)});
  }
  const double near_mm = std::max(most_mm, 4 * scatter_about(plane, places));
  std::vector<Vector3d> near;
  std::copy_if(places.begin(), places.end(), std::back_inserter(near),
               [&](const Vector3d& place) { return plane.distance_mm(place) <= near_mm; });
  return plane_through(near);
}

GuideSlice slice_of(const std::vector<Vector3d>& places, std::vector<double> sigmas_mm) {
  GuideSlice slice;
  slice.points = places.size();
  if (places.empty()) return slice;
  const double most_mm = std::max(rounding_mm, most_sigmas_across * signal::median(std::move(sigmas_mm)));
  // Three points are always in a plane.
  const Plane plane = places.size() > 3 ? plane_of_most(places, most_mm) : plane_through(places);
  slice.centre_mm = plane.centre_mm;
  slice.normal = plane.normal;
  slice.scatter_mm = scatter_about(plane, places);
  slice.is_plane = places.size() > 3 && plane.points >= most_of(places.size()) &&
                   slice.scatter_mm <= most_mm && slice.scatter_mm * least_widths < plane.width_mm;
  return slice;
}

}  // namespace

std::vector<GuideSlice> guide_slices(const GuidePoints& guide) {
  std::vector<std::vector<Vector3d>> places(guide.slices.size());
  std::vector<std::vector<double>> sigmas_mm(guide.slices.size());
  for (const GuidePoint& point : guide.points) {
    // A click at an apex or at the base may show where it is thought to be, beside the image's plane.
    if (is_landmark(point.surface)) continue;
    places[point.slice].push_back(point.place_mm);
    sigmas_mm[point.slice].push_back(point.sigma_mm);
  }
  std::vector<GuideSlice> slices;
  for (size_t s = 0; s < places.size(); ++s)
    slices.push_back(slice_of(places[s], std::move(sigmas_mm[s])));
  return slices;
}

}  // namespace diastole::imaging
