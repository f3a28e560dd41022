#include "estimator/imaging/geometry/cine_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "estimator/imaging/geometry/slab_edges.hpp"
#include "estimator/imaging/geometry/ventricle_fit.hpp"
#include "estimator/imaging/geometry/wall_rays.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int rays = 24;
/// Of an edge between pixels where noise is a few per cent of the contrast; the fit finds its true size.
constexpr double edge_sigma_mm = 0.4;
/// Between rows across the axis in long-axis images.
constexpr double row_step_mm = 2.5;

struct Contour {
  std::vector<Vector2d> inner, outer;  // in-plane mm
};

Vector2d turned(double angle) { return {std::cos(angle), std::sin(angle)}; }

Contour contour_from(const CineSlice& slice, const FineImage& image, const Vector2d& centre) {
  Contour contour;
  for (int i = 0; i < rays; ++i) {
    const Vector2d direction = turned(2 * std::numbers::pi * i / rays);
    const std::optional<WallOnRay> wall = wall_on_ray(slice, profile_of(image, centre, direction));
    if (!wall) continue;
    contour.inner.push_back(centre + wall->inner_mm * direction);
    contour.outer.push_back(centre + wall->outer_mm * direction);
  }
  return contour;
}

Vector2d mean_of(const std::vector<Vector2d>& points) {
  Vector2d sum = Vector2d::Zero();
  for (const Vector2d& point : points)
    sum += point;
  return sum / static_cast<double>(points.size());
}

double radius_of(const std::vector<Vector2d>& points) {
  const Vector2d centre = mean_of(points);
  double sum = 0;
  for (const Vector2d& point : points)
    sum += (point - centre).norm();
  return sum / static_cast<double>(points.size());
}

class CineFinder {
 public:
  explicit CineFinder(const Cines& cines) : cines_(cines) {
    guide_.file = cines.folder.string();
    guide_.findings = cines.findings;
    guide_.phases = cines.phases;
    for (const CineSlice& slice : cines.slices)
      guide_.slices.push_back(slice.name);
  }

  GuidePoints found() {
    std::vector<double> base_mm;
    for (size_t p = 0; p < guide_.phases.size(); ++p) {
      const size_t before = guide_.points.size();
      for (size_t s = 0; s < cines_.slices.size(); ++s)
        if (cines_.slices[s].is_long && cines_.slices[s].has(p)) find_long(p, s);
      base_mm.push_back(base_height_mm(before));
    }
    // A phase that no long-axis image shows has its base no lower than any other.
    const double lowest_mm = std::ranges::min(base_mm);
    for (size_t p = 0; p < guide_.phases.size(); ++p)
      find_short(p, std::isfinite(base_mm[p]) ? base_mm[p] : lowest_mm);
    if (guide_.points.empty())
      throw InputError(
          {guide_.file, "", "no wall around blood is seen",
           "Give bright-blood cines of a ventricle, or set guide points by hand (diastole desk)."});
    return guide_;
  }

 private:
  void add(size_t phase, size_t slice, GuideSurface surface, const Vector2d& mm) {
    guide_.points.push_back({phase, slice, surface, cines_.slices[slice].plane.at(mm), edge_sigma_mm});
  }

  /// The lowest point of the base among those from a place on, along the axis; without any: infinity.
  [[nodiscard]] double base_height_mm(size_t from) const {
    double height = std::numeric_limits<double>::infinity();
    for (size_t i = from; i < guide_.points.size(); ++i)
      if (guide_.points[i].surface == GuideSurface::base)
        height = std::min(height, cines_.height_mm(guide_.points[i].place_mm));
    return height;
  }

  void find_short(size_t phase, double base_mm) {
    std::vector<Contour> contours(cines_.slices.size());
    for (size_t s = 0; s < cines_.slices.size(); ++s) {
      const CineSlice& slice = cines_.slices[s];
      // A slice that the base cuts, or nearly, shows two things at once.
      const double top_mm = cines_.height_mm(cines_.crossing_mm(slice)) + 0.5 * slice.plane.thickness_mm;
      if (slice.is_long || !slice.has(phase) || top_mm > base_mm) continue;
      Vector2d centre = slice.plane.in_plane_mm(cines_.crossing_mm(slice));
      // The slice may be displaced: its centre is that of its contour.
      const FineImage image = fine_image(slice, slice.images[phase]);
      for (int i = 0; i < 3; ++i) {
        contours[s] = contour_from(slice, image, centre);
        if (contours[s].inner.size() < rays / 3) break;
        centre = mean_of(contours[s].inner);
      }
      // A few rays with something like a wall are chance.
      if (contours[s].inner.size() < rays / 3) contours[s] = {};
    }
    for (size_t s = 0; s + 1 < cines_.slices.size(); ++s) {
      if (contours[s].inner.empty() || cines_.slices[s + 1].is_long) continue;
      if (contours[s + 1].inner.empty()) continue;
      const double apart = std::abs(cines_.slices[s].plane.normal().dot(cines_.slices[s + 1].plane.origin_mm -
                                                                        cines_.slices[s].plane.origin_mm));
      const auto is_upright = [&](const std::vector<Vector2d>& low, const std::vector<Vector2d>& high) {
        return radius_of(high) - radius_of(low) < 0.5 * apart;
      };
      if (is_upright(contours[s].inner, contours[s + 1].inner))
        put(phase, s, GuideSurface::endo, contours[s].inner);
      if (is_upright(contours[s].outer, contours[s + 1].outer))
        put(phase, s, GuideSurface::epi, contours[s].outer);
      const bool is_top =
          s + 2 == cines_.slices.size() || cines_.slices[s + 2].is_long || contours[s + 2].inner.empty();
      if (!is_top) continue;
      put(phase, s + 1, GuideSurface::endo, contours[s + 1].inner);
      put(phase, s + 1, GuideSurface::epi, contours[s + 1].outer);
    }
  }

  void put(size_t phase, size_t slice, GuideSurface surface, const std::vector<Vector2d>& points) {
    for (const Vector2d& point : points)
      add(phase, slice, surface, point);
  }

  void find_long(size_t phase, size_t s) {
    const CineSlice& slice = cines_.slices[s];
    const FineImage image = fine_image(slice, slice.images[phase]);
    const Vector2d middle = slice.plane.in_plane_mm(cines_.axis_point_mm);
    const Vector2d up = (slice.plane.in_plane_mm(cines_.axis_point_mm + cines_.axis) - middle).normalized();
    // The apex of the cavity, from the middle of the blood downwards.
    const std::optional<WallOnRay> apex = wall_on_ray(slice, profile_of(image, middle, -up));
    if (!apex) return;
    // Across the axis from the apex to above the base, and a fan about the apex.
    const Vector2d across(-up.y(), up.x());
    std::array<std::vector<WallOnRay>, 2> side;
    std::array<std::vector<double>, 2> height;
    for (double h = -0.5 * apex->inner_mm; h < ray_mm; h += row_step_mm) {
      for (size_t k = 0; k < 2; ++k) {
        const Vector2d direction = k == 0 ? across : Vector2d(-across);
        const std::optional<WallOnRay> wall =
            wall_on_ray(slice, profile_of(image, middle + h * up, direction));
        if (!wall) continue;
        // One row may be missing; above two nothing is the ventricle's.
        if (!height[k].empty() && h > height[k].back() + 2.5 * row_step_mm) continue;
        side[k].push_back(*wall);
        height[k].push_back(h);
      }
    }
    const Vector2d focus = middle - 0.7 * apex->inner_mm * up;
    for (int i = -4; i <= 4; ++i) {
      const double angle = i * std::numbers::pi / 10;
      const Vector2d direction = -std::cos(angle) * up + std::sin(angle) * across;
      const std::optional<WallOnRay> wall = wall_on_ray(slice, profile_of(image, focus, direction));
      if (!wall) continue;
      add(phase, s, GuideSurface::endo, focus + wall->inner_mm * direction);
      add(phase, s, GuideSurface::epi, focus + wall->outer_mm * direction);
    }
    const double blur_mm = edge_blur_mm(slice.plane);
    for (size_t k = 0; k < 2; ++k) {
      if (side[k].empty()) continue;
      const Vector2d direction = k == 0 ? across : Vector2d(-across);
      // Rows that are blurred with what is above the base show no wall as it is; this one is surely not.
      size_t low = side[k].size() - 1;
      while (low > 0 && height[k].back() - height[k][low] < 2 * blur_mm)
        --low;
      const std::optional<double> end_mm =
          find_base(phase, s, image, middle + height[k][low] * up, direction, up, side[k][low]);
      const double last_mm = height[k][low] + std::max(0.0, end_mm.value_or(0.0) - blur_mm);
      for (size_t i = 0; i < side[k].size() && height[k][i] <= last_mm; ++i) {
        const Vector2d on_axis = middle + height[k][i] * up;
        add(phase, s, GuideSurface::endo, on_axis + side[k][i].inner_mm * direction);
        add(phase, s, GuideSurface::epi, on_axis + side[k][i].outer_mm * direction);
      }
    }
  }

  /// Upwards through the wall, in three places of its thickness; returns the middle one of where it ends, in mm above `from`.
  std::optional<double> find_base(size_t phase, size_t s, const FineImage& image, const Vector2d& from,
                                  const Vector2d& outwards, const Vector2d& up, const WallOnRay& wall) {
    const CineSlice& slice = cines_.slices[s];
    std::vector<double> ends_mm;
    for (const double part : {0.35, 0.5, 0.65}) {
      const Vector2d start = from + std::lerp(wall.inner_mm, wall.outer_mm, part) * outwards;
      const std::optional<double> end_mm = end_of_wall(slice, profile_of(image, start, up));
      if (!end_mm || *end_mm >= 25) continue;
      add(phase, s, GuideSurface::base, start + *end_mm * up);
      ends_mm.push_back(*end_mm);
    }
    if (ends_mm.empty()) return {};
    std::ranges::sort(ends_mm);
    return ends_mm[ends_mm.size() / 2];
  }

  const Cines& cines_;
  GuidePoints guide_;
};

}  // namespace

GuidePoints cine_guide_points(const Cines& cines) {
  GuidePoints points = CineFinder(cines).found();
  std::vector<SlicePlane> planes;
  for (const CineSlice& slice : cines.slices)
    planes.push_back(slice.plane);
  try {
    const VentricleFit fit = fit_ventricle(points);
    if (fit.converged) move_to_mid_slice(points, fit, planes);
  } catch (const InputError&) {
    // Who fits these points gets to know why they make no ventricle.
  }
  return points;
}

}  // namespace diastole::imaging
