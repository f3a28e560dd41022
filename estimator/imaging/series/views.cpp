#include "estimator/imaging/series/views.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace diastole::imaging {
namespace {

/// Planes are set by hand at the scanner: within 15 degrees of a right angle counts as one.
constexpr double sine_of_tolerance = 0.26;

struct Candidate {
  const ImageSeries* series;
  size_t crossed;   // slices of other series at a right angle
  size_t parallel;  // series of this very orientation
};

Candidate examined(const ImageFolder& folder, const ImageSeries& series) {
  Candidate candidate{&series, 0, 0};
  for (const ImageSeries& other : folder.series) {
    const double cosine = std::abs(series.plane().normal().dot(other.plane().normal()));
    if (cosine < sine_of_tolerance) candidate.crossed += other.slices.size();
    if (cosine > std::sqrt(1 - sine_of_tolerance * sine_of_tolerance))
      candidate.parallel += other.slices.size();
  }
  return candidate;
}

/// The orientation that most others are at a right angle to; of two that cross only each other the one with more slices.
const ImageSeries* short_axis(const ImageFolder& folder) {
  Candidate best{nullptr, 0, 0};
  for (const ImageSeries& series : folder.series) {
    const Candidate candidate = examined(folder, series);
    if (candidate.crossed == 0) continue;
    if (best.series == nullptr ||
        std::pair(candidate.crossed, candidate.parallel) > std::pair(best.crossed, best.parallel))
      best = candidate;
  }
  return best.series;
}

}  // namespace

Eigen::Vector3d tag_normal(const SlicePlane& plane, const TagWave& tag) {
  return (tag.per_mm.x() * plane.along_row + tag.per_mm.y() * plane.along_column).normalized();
}

std::string view_in_words(const ImageFolder& folder, const ImageSeries& series) {
  const std::string anatomical = orientation_in_words(series.plane());
  const ImageSeries* reference = short_axis(folder);
  if (reference == nullptr) return anatomical;
  const Eigen::Vector3d normal = series.plane().normal();
  if (std::abs(normal.dot(reference->plane().normal())) > 0.5)
    return fmt::format("short axis ({})", anatomical);
  // The slice contains the direction at a right angle to its own normal and to the axis.
  const Eigen::Vector3d within = reference->plane().normal().cross(normal);
  double angle_deg =
      std::atan2(within.dot(reference->plane().along_column), within.dot(reference->plane().along_row)) *
      180.0 / std::numbers::pi;
  angle_deg -= 180.0 * std::floor(angle_deg / 180.0);
  if (angle_deg > 179.5) angle_deg = 0;
  return fmt::format("long axis, {:.0f} degrees ({})", angle_deg, anatomical);
}

}  // namespace diastole::imaging
