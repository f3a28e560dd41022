#include "estimator/imaging/geometry/wall_rays.hpp"

#include <cmath>

namespace diastole::imaging {
namespace {

using Eigen::Vector2d;

constexpr double least_wall_mm = 3, most_wall_mm = 25;

/// Between the four pixels around; nothing outside.
std::optional<double> grey_at(const CineSlice& slice, const Eigen::ArrayXXd& image, const Vector2d& mm) {
  const double column = mm.x() / slice.plane.column_spacing_mm, row = mm.y() / slice.plane.row_spacing_mm;
  const auto c = static_cast<Eigen::Index>(std::floor(column)),
             r = static_cast<Eigen::Index>(std::floor(row));
  if (c < 0 || r < 0 || c + 1 >= image.cols() || r + 1 >= image.rows()) return {};
  const double u = column - static_cast<double>(c), v = row - static_cast<double>(r);
  return (1 - v) * ((1 - u) * image(r, c) + u * image(r, c + 1)) +
         v * ((1 - u) * image(r + 1, c) + u * image(r + 1, c + 1));
}

}  // namespace

std::optional<double> falls_through(const std::vector<double>& profile, double level, size_t from) {
  for (size_t i = std::max<size_t>(from, 1); i < profile.size(); ++i) {
    if (profile[i] >= level || profile[i - 1] < level) continue;
    return ray_step_mm * (static_cast<double>(i) - (level - profile[i]) / (profile[i - 1] - profile[i]));
  }
  return {};
}

std::vector<double> profile_of(const CineSlice& slice, const Eigen::ArrayXXd& image, const Vector2d& from,
                               const Vector2d& direction) {
  std::vector<double> profile;
  for (double r = 0; r < ray_mm; r += ray_step_mm) {
    const std::optional<double> grey = grey_at(slice, image, from + r * direction);
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
  const auto after = static_cast<size_t>(*inner / ray_step_mm) + 1;
  const std::optional<double> outer = falls_through(profile, levels.outer(), after);
  if (!outer || *outer - *inner < least_wall_mm || *outer - *inner > most_wall_mm) return {};
  // Between the two it is a wall: its middle half has the wall's level.
  double sum = 0, count = 0;
  for (size_t i = after; i < profile.size(); ++i) {
    const double part = (ray_step_mm * static_cast<double>(i) - *inner) / (*outer - *inner);
    if (part < 0.35 || part > 0.65) continue;
    sum += profile[i];
    count += 1;
  }
  if (count == 0 || sum / count > levels.inner() || sum / count < levels.outer()) return {};
  return WallOnRay{*inner, *outer};
}
}  // namespace diastole::imaging
