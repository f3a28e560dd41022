#include "estimator/imaging/geometry/wall_rays.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/imaging/series/spectrum.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector2d;

bool is_a_wall(double thickness_mm) { return thickness_mm >= 3 && thickness_mm <= 25; }

/// Between the four places around; nothing outside.
std::optional<double> grey_at(const FineImage& image, const Vector2d& mm) {
  const double column = mm.x() / image.column_spacing_mm, row = mm.y() / image.row_spacing_mm;
  const auto c = static_cast<Eigen::Index>(std::floor(column)),
             r = static_cast<Eigen::Index>(std::floor(row));
  if (c < 0 || r < 0 || c + 1 >= image.grey.cols() || r + 1 >= image.grey.rows()) return {};
  const double u = column - static_cast<double>(c), v = row - static_cast<double>(r);
  const auto grey = [&](Eigen::Index i, Eigen::Index j) {
    return static_cast<double>(image.grey(r + i, c + j));
  };
  return (1 - v) * ((1 - u) * grey(0, 0) + u * grey(0, 1)) + v * ((1 - u) * grey(1, 0) + u * grey(1, 1));
}

size_t sample_after(double mm) { return static_cast<size_t>(std::max(0.0, mm) / ray_step_mm) + 1; }

/// Nothing where the profile does not reach.
std::optional<double> mean_between(const std::vector<double>& profile, double from_mm, double to_mm) {
  double sum = 0, count = 0;
  for (size_t i = from_mm > 0 ? sample_after(from_mm) : 0;
       i < profile.size() && ray_step_mm * static_cast<double>(i) < to_mm; ++i) {
    sum += profile[i];
    count += 1;
  }
  if (count == 0) return {};
  return sum / count;
}

/// Where a profile falls through a level for the first time from a sample on, in mm; nothing if it does not.
std::optional<double> falls_through(const std::vector<double>& profile, double level, size_t from) {
  for (size_t i = std::max<size_t>(from, 1); i < profile.size(); ++i) {
    if (profile[i] >= level || profile[i - 1] < level) continue;
    return ray_step_mm * (static_cast<double>(i) - (level - profile[i]) / (profile[i - 1] - profile[i]));
  }
  return {};
}

/// Where a profile falls through the middle of what is seen to either side of an edge; nothing where it does not between two places.
std::optional<double> half_way(const std::vector<double>& profile, const std::array<double, 2>& between_mm,
                               std::optional<double> inside, std::optional<double> outside) {
  if (!inside || !outside || *inside <= *outside) return {};
  const std::optional<double> edge =
      falls_through(profile, 0.5 * (*inside + *outside), sample_after(between_mm[0]));
  return edge && *edge < between_mm[1] ? edge : std::nullopt;
}

}  // namespace

double edge_blur_mm(const SlicePlane& plane) {
  return 1.5 * std::max(plane.column_spacing_mm, plane.row_spacing_mm);
}

FineImage fine_image(const CineSlice& slice, const Eigen::ArrayXXd& image) {
  constexpr Eigen::Index finer = 4;  // linear weights between are then good to a hundredth of a pixel
  // Beyond the last pixel lies what the first shows.
  return {zero_filled(image.cast<float>(), finer)
              .topLeftCorner(finer * (image.rows() - 1) + 1, finer * (image.cols() - 1) + 1),
          slice.plane.row_spacing_mm / finer, slice.plane.column_spacing_mm / finer};
}

std::vector<double> profile_of(const FineImage& image, const Vector2d& from, const Vector2d& direction) {
  std::vector<double> profile;
  for (double r = 0; r < ray_mm; r += ray_step_mm) {
    const std::optional<double> grey = grey_at(image, from + r * direction);
    if (!grey) break;
    profile.push_back(*grey);
  }
  return profile;
}

std::optional<WallOnRay> wall_on_ray(const CineSlice& slice, const std::vector<double>& profile) {
  const GreyLevels& levels = slice.levels;
  if (profile.empty() || profile[0] < levels.inner()) return {};
  const std::optional<double> inner = falls_through(profile, levels.inner(), 0);
  if (!inner) return {};
  const std::optional<double> outer = falls_through(profile, levels.outer(), sample_after(*inner));
  if (!outer || !is_a_wall(*outer - *inner)) return {};
  // Between the two it is a wall: its middle third has the wall's level.
  const double third = (*outer - *inner) / 3;
  const std::optional<double> wall = mean_between(profile, *inner + third, *outer - third);
  if (!wall || *wall > levels.inner() || *wall < levels.outer()) return {};
  const double blur_mm = edge_blur_mm(slice.plane);
  const std::optional<double> blood = mean_between(profile, *inner - 2 * blur_mm, *inner - blur_mm);
  const std::optional<double> around = mean_between(profile, *outer + blur_mm, *outer + 2 * blur_mm);
  const WallOnRay found{half_way(profile, {*inner - blur_mm, *inner + third}, blood, wall).value_or(*inner),
                        half_way(profile, {*outer - third, *outer + blur_mm}, wall, around).value_or(*outer)};
  return is_a_wall(found.outer_mm - found.inner_mm) ? std::optional(found) : std::nullopt;
}

std::optional<double> end_of_wall(const CineSlice& slice, const std::vector<double>& profile) {
  return falls_through(profile, slice.levels.outer(), 0);
}

}  // namespace diastole::imaging
