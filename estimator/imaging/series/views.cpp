#include "estimator/imaging/series/views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "protocol/contract/angle.hpp"

namespace diastole::imaging {
namespace {

/// Planes are set by hand at the scanner: within 15 degrees of a right angle counts as one.
constexpr double sine_of_tolerance = 0.26;

bool at_right_angle(const SlicePlane& a, const SlicePlane& b) {
  return std::abs(a.normal().dot(b.normal())) < sine_of_tolerance;
}

bool parallel(const SlicePlane& a, const SlicePlane& b) {
  return a.normal().cross(b.normal()).norm() < sine_of_tolerance;
}

/// All slices of one orientation, of whatever series.
struct Orientation {
  const SlicePlane* plane;
  std::set<long> places_mm{};  ///< along the normal
};

/// Of what moves, or of everything if nothing does: localisers lie as the magnet does.
std::vector<Orientation> orientations(const ImageFolder& folder) {
  std::vector<Orientation> found;
  const auto is_still = [](const ImageSeries& series) { return series.kind == SeriesKind::anatomy; };
  const bool all_still = std::ranges::all_of(folder.series, is_still);
  for (const ImageSeries& series : folder.series) {
    if (is_still(series) && !all_still) continue;
    const auto of_series = [&](const Orientation& one) { return parallel(*one.plane, series.plane()); };
    auto one = std::ranges::find_if(found, of_series);
    if (one == found.end()) one = found.insert(found.end(), {&series.plane()});
    for (const SliceImages& slice : series.slices)
      one->places_mm.insert(std::lround(one->plane->normal().dot(slice.plane.origin_mm)));
  }
  return found;
}

/// The orientation at a right angle to most others. Where several are, as with one long axis or with two that cross each other, the
/// one with more places, as a stack is; then the one nearest to transverse, as the axis of what lies in a scanner mostly is.
const SlicePlane* short_axis(const ImageFolder& folder) {
  const std::vector<Orientation> all = orientations(folder);
  const SlicePlane* best = nullptr;
  std::tuple<long, size_t, double> most{0, 0, 0};
  for (const Orientation& one : all) {
    const auto crossed = std::ranges::count_if(
        all, [&](const Orientation& other) { return at_right_angle(*one.plane, *other.plane); });
    const std::tuple<long, size_t, double> of_this{crossed, one.places_mm.size(),
                                                   std::abs(one.plane->normal().z())};
    if (crossed == 0 || of_this <= most) continue;
    best = one.plane;
    most = of_this;
  }
  return best;
}

}  // namespace

Eigen::Vector3d tag_normal(const SlicePlane& plane, const TagWave& tag) {
  return (tag.per_mm.x() * plane.along_row + tag.per_mm.y() * plane.along_column).normalized();
}

std::string view_in_words(const ImageFolder& folder, const ImageSeries& series) {
  const std::string anatomical = orientation_in_words(series.plane());
  const SlicePlane* reference = short_axis(folder);
  if (reference == nullptr) return anatomical;
  const Eigen::Vector3d normal = series.plane().normal();
  if (std::abs(normal.dot(reference->normal())) > 0.5) return fmt::format("short axis ({})", anatomical);
  // The slice contains the direction at a right angle to its own normal and to the axis.
  const Eigen::Vector3d within = reference->normal().cross(normal);
  double angle_deg =
      std::atan2(within.dot(reference->along_column), within.dot(reference->along_row)) / rad_per_deg;
  angle_deg -= 180.0 * std::floor(angle_deg / 180.0);
  if (angle_deg > 179.5) angle_deg = 0;
  return fmt::format("long axis, {:.0f} degrees ({})", angle_deg, anatomical);
}

}  // namespace diastole::imaging
