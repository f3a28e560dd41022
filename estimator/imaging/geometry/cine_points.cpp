#include "estimator/imaging/geometry/cine_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>

#include "estimator/imaging/series/image_folder.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double step_mm = 0.25;  // along a ray: a fraction of any pixel
constexpr double ray_mm = 70;     // farther than any ventricle's wall from its middle
constexpr double least_wall_mm = 3, most_wall_mm = 25;
constexpr int rays = 24;
/// Of an edge between pixels where noise is a few per cent of the contrast; the fit finds its true size.
constexpr double edge_sigma_mm = 0.4;

/// Grey values of the three materials.
struct Levels {
  double around = 0, wall = 0, blood = 0;
  [[nodiscard]] double inner() const { return 0.5 * (blood + wall); }
  [[nodiscard]] double outer() const { return 0.5 * (wall + around); }
};

struct CineSlice {
  std::string name;
  SlicePlane plane;
  bool is_long = false;
  std::vector<Eigen::ArrayXXd> images;  // by phase; without pixels where the slice lacks it
  Levels levels;

  [[nodiscard]] bool has(size_t phase) const { return images[phase].size() > 0; }
  [[nodiscard]] const Eigen::ArrayXXd& first_image() const {
    return *std::ranges::find_if(images, [](const Eigen::ArrayXXd& image) { return image.size() > 0; });
  }
};

/// In-plane mm, from the first pixel's centre.
Vector2d on_image(const SlicePlane& plane, const Vector3d& place) {
  const Vector3d from = place - plane.origin_mm;
  return {from.dot(plane.along_row), from.dot(plane.along_column)};
}

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

/// Three means of all slices' grey values (Lloyd's iteration): a slice below the apex shows no blood of its own.
Levels levels_of(const std::vector<CineSlice>& slices) {
  std::vector<double> values;
  for (const CineSlice& slice : slices)
    for (const Eigen::ArrayXXd& image : slice.images)
      values.insert(values.end(), image.data(), image.data() + image.size());
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double q) {
    return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
  };
  std::array<double, 3> mean{quantile(0.1), 0, quantile(0.99)};
  // Muscle is nearer to dark surroundings than to blood.
  mean[1] = mean[0] + 0.3 * (mean[2] - mean[0]);
  for (int i = 0; i < 30; ++i) {
    std::array<double, 3> sum{}, count{};
    for (const double value : values) {
      const size_t k = value < 0.5 * (mean[0] + mean[1]) ? 0 : value < 0.5 * (mean[1] + mean[2]) ? 1 : 2;
      sum[k] += value;
      count[k] += 1;
    }
    for (size_t k = 0; k < 3; ++k)
      if (count[k] > 0) mean[k] = sum[k] / count[k];
  }
  return {mean[0], mean[1], mean[2]};
}

struct WallOnRay {
  double inner_mm, outer_mm;
};

/// Where a profile falls through a level for the first time, from a place on; nothing if it does not.
std::optional<double> falls_through(const std::vector<double>& profile, double level, size_t from) {
  for (size_t i = std::max<size_t>(from, 1); i < profile.size(); ++i) {
    if (profile[i] >= level || profile[i - 1] < level) continue;
    return step_mm * (static_cast<double>(i) - (level - profile[i]) / (profile[i - 1] - profile[i]));
  }
  return {};
}

std::vector<double> profile_of(const CineSlice& slice, const Eigen::ArrayXXd& image, const Vector2d& from,
                               const Vector2d& direction) {
  std::vector<double> profile;
  for (double r = 0; r < ray_mm; r += step_mm) {
    const std::optional<double> grey = grey_at(slice, image, from + r * direction);
    if (!grey) break;
    profile.push_back(*grey);
  }
  return profile;
}

std::optional<WallOnRay> wall_on_ray(const CineSlice& slice, const std::vector<double>& profile) {
  const Levels& levels = slice.levels;
  if (profile.empty() || profile[0] < levels.inner()) return {};
  const std::optional<double> inner = falls_through(profile, levels.inner(), 0);
  if (!inner) return {};
  const auto after = static_cast<size_t>(*inner / step_mm) + 1;
  const std::optional<double> outer = falls_through(profile, levels.outer(), after);
  if (!outer || *outer - *inner < least_wall_mm || *outer - *inner > most_wall_mm) return {};
  // Between the two it is a wall: its middle half has the wall's level.
  double sum = 0, count = 0;
  for (size_t i = after; i < profile.size(); ++i) {
    const double part = (step_mm * static_cast<double>(i) - *inner) / (*outer - *inner);
    if (part < 0.35 || part > 0.65) continue;
    sum += profile[i];
    count += 1;
  }
  if (count == 0 || sum / count > levels.inner() || sum / count < levels.outer()) return {};
  return WallOnRay{*inner, *outer};
}

struct Contour {
  std::vector<Vector2d> inner, outer;  // in-plane mm
};

Vector2d turned(double angle) { return {std::cos(angle), std::sin(angle)}; }

Contour contour_from(const CineSlice& slice, const Eigen::ArrayXXd& image, const Vector2d& centre) {
  Contour contour;
  for (int i = 0; i < rays; ++i) {
    const Vector2d direction = turned(2 * std::numbers::pi * i / rays);
    const std::optional<WallOnRay> wall = wall_on_ray(slice, profile_of(slice, image, centre, direction));
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

/// A line through the ventricle, towards the base.
struct Axis {
  Vector3d point, direction;
};

class CineFinder {
 public:
  CineFinder(const ImageFolder& folder, const std::filesystem::path& path) {
    guide_.file = path.string();
    guide_.findings = folder.problems;
    read_slices(folder);
    find_axis();
    name_slices();
    number_phases();
    for (const CineSlice& slice : slices_)
      guide_.slices.push_back(slice.name);
  }

  GuidePoints found() {
    std::vector<double> base_mm;
    for (size_t p = 0; p < guide_.phases.size(); ++p) {
      const size_t before = guide_.points.size();
      for (size_t s = 0; s < slices_.size(); ++s)
        if (slices_[s].is_long && slices_[s].has(p)) find_long(p, s);
      base_mm.push_back(base_height_mm(before));
    }
    // A phase that no long-axis image shows has its base no lower than any other.
    const double lowest_mm = std::ranges::min(base_mm);
    for (size_t p = 0; p < guide_.phases.size(); ++p)
      find_short(p, std::isfinite(base_mm[p]) ? base_mm[p] : lowest_mm);
    if (guide_.points.empty())
      refuse("no wall around blood is seen",
             "Give bright-blood cines of a ventricle, or set guide points by hand.");
    return guide_;
  }

 private:
  [[noreturn]] void refuse(const std::string& problem, const std::string& remedy) const {
    throw InputError({guide_.file, "", problem, remedy});
  }

  static std::vector<double> triggers_ms(const ImageFolder& folder, const SliceImages& slice) {
    std::vector<double> times_ms;
    for (const size_t image : slice.images)
      if (const auto& trigger_ms = folder.images[image].header.trigger_ms) times_ms.push_back(*trigger_ms);
    return times_ms;
  }
  /// Of one slice by itself, with those that are missing between its others.
  static PhaseTimes times_of(const ImageFolder& folder, const SliceImages& slice) {
    return phase_times(std::vector<std::vector<double>>{triggers_ms(folder, slice)});
  }

  /// Of the cine slices: phase contrast's magnitudes, one slice of more phases, look like a cine.
  static size_t phases_of_most(const ImageFolder& folder) {
    std::map<size_t, size_t> slices;
    for (const ImageSeries& series : folder.series)
      for (const SliceImages& slice : series.slices)
        if (series.kind == SeriesKind::cine) ++slices[times_of(folder, slice).times_ms.size()];
    const auto most = std::ranges::max_element(slices, {}, [](const auto& count) { return count.second; });
    return most == slices.end() ? 0 : most->first;
  }

  /// The times that all slices have in common; nothing where their cycles differ.
  static std::optional<PhaseTimes> times_in_common(const ImageFolder& folder, size_t phases) {
    std::vector<std::vector<double>> times_ms;
    for (const ImageSeries& series : folder.series) {
      if (series.kind != SeriesKind::cine) continue;
      for (const SliceImages& slice : series.slices)
        if (2 * slice.images.size() > phases && times_of(folder, slice).times_ms.size() <= phases)
          times_ms.push_back(triggers_ms(folder, slice));
    }
    PhaseTimes times = phase_times(times_ms);
    return times.times_ms.size() == phases ? std::optional(std::move(times)) : std::nullopt;
  }

  /// Images by phase: of times that all slices have in common, else of each slice's own, as where the heart's rate changed.
  void read_slices(const ImageFolder& folder) {
    const size_t phases = phases_of_most(folder);
    const std::optional<PhaseTimes> common = times_in_common(folder, phases);
    for (const ImageSeries& series : folder.series) {
      if (series.kind != SeriesKind::cine) continue;
      for (const SliceImages& slice : series.slices) {
        const PhaseTimes times = common ? *common : times_of(folder, slice);
        CineSlice one;
        one.plane = slice.plane;
        one.images.resize(phases);
        const std::vector<Image> pixels = folder.pixels(slice.images);
        size_t placed = 0;
        for (size_t i = 0; i < pixels.size() && times.times_ms.size() == phases; ++i) {
          const auto& trigger_ms = folder.images[slice.images[i]].header.trigger_ms;
          const std::optional<size_t> phase = trigger_ms ? times.index_of(*trigger_ms) : std::nullopt;
          if (!phase || one.has(*phase)) continue;
          one.images[*phase] = pixels[i].cast<double>();
          ++placed;
        }
        if (2 * placed > phases && placed == pixels.size()) {
          slices_.push_back(std::move(one));
          continue;
        }
        guide_.findings.push_back(
            {Severity::warning, "other-phases",
             fmt::format("a slice of series {} has {} images, of which {} are at a time of the {} phases of "
                         "the others: it is left out",
                         series.number, pixels.size(), placed, phases),
             "", static_cast<double>(pixels.size()), "", "Export all phases of it."});
      }
    }
    const Levels levels = slices_.empty() ? Levels{} : levels_of(slices_);
    for (CineSlice& slice : slices_)
      slice.levels = levels;
    if (slices_.size() < 3)
      refuse(fmt::format("has {} slices of cines", slices_.size()),
             "Give the folder of a cine study: short-axis slices, and long-axis ones too.");
  }

  /// The short axis is the orientation that most slices have; the long-axis planes meet in the axis.
  void find_axis() {
    std::vector<size_t> alike(slices_.size(), 0);
    for (size_t a = 0; a < slices_.size(); ++a)
      for (const CineSlice& b : slices_)
        if (std::abs(slices_[a].plane.normal().dot(b.plane.normal())) > 0.99) ++alike[a];
    const auto most = static_cast<size_t>(std::max_element(alike.begin(), alike.end()) - alike.begin());
    const Vector3d across = slices_[most].plane.normal();
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(3, 3);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(3);
    Vector3d middle = Vector3d::Zero();
    for (CineSlice& slice : slices_) {
      const Vector3d n = slice.plane.normal();
      slice.is_long = std::abs(n.dot(across)) < std::sqrt(0.5);
      if (slice.is_long) {
        square += n * n.transpose();
        right += n * n.dot(slice.plane.origin_mm);
      }
      middle += centre_of_blood(slice) / static_cast<double>(slices_.size());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(square);
    axis_ = {middle, across};
    // Two planes or more, of different directions.
    if (axes.eigenvalues()[1] > 0.1) {
      axis_.direction = axes.eigenvectors().col(0);
      const Eigen::VectorXd on_planes = square.completeOrthogonalDecomposition().solve(right);
      axis_.point = on_planes + axis_.direction * axis_.direction.dot(middle - on_planes.head<3>());
    }
    if (!points_to_base()) axis_.direction = -axis_.direction;
  }

  /// The middle of what is as bright as blood in the first phase.
  static Vector3d centre_of_blood(const CineSlice& slice) {
    const Eigen::ArrayXXd& image = slice.first_image();
    Vector2d sum = Vector2d::Zero();
    double count = 1e-9;
    for (Eigen::Index r = 0; r < image.rows(); ++r)
      for (Eigen::Index c = 0; c < image.cols(); ++c)
        if (image(r, c) > slice.levels.inner()) {
          sum += Vector2d(static_cast<double>(c) * slice.plane.column_spacing_mm,
                          static_cast<double>(r) * slice.plane.row_spacing_mm);
          count += 1;
        }
    return slice.plane.at(sum / count);
  }

  /// At the apex a wall closes the blood, at the base it does not; where no long-axis image shows it, the blood is wider at the base.
  [[nodiscard]] bool points_to_base() const {
    int votes = 0;
    for (const CineSlice& slice : slices_) {
      const Vector2d centre = on_image(slice.plane, axis_.point);
      if (slice.is_long) {
        const Vector2d up = (on_image(slice.plane, axis_.point + axis_.direction) - centre).normalized();
        const auto closed = [&](const Vector2d& d) {
          return wall_on_ray(slice, profile_of(slice, slice.first_image(), centre, d)).has_value();
        };
        votes += (closed(-up) ? 1 : 0) - (closed(up) ? 1 : 0);
      }
    }
    if (votes != 0) return votes > 0;
    double slope = 0;
    for (const CineSlice& slice : slices_) {
      if (slice.is_long) continue;
      const double height = axis_.direction.dot(slice.plane.origin_mm - axis_.point);
      slope += height * static_cast<double>((slice.first_image() > slice.levels.inner()).count());
    }
    return slope > 0;
  }

  /// Those that some slice shows, by their numbers.
  void number_phases() {
    const size_t all = slices_[0].images.size();
    for (size_t p = 0; p < all; ++p)
      if (std::ranges::any_of(slices_, [&](const CineSlice& slice) { return slice.has(p); }))
        guide_.phases.push_back(static_cast<int>(p));
    if (guide_.phases.size() == all) return;
    for (CineSlice& slice : slices_) {
      std::vector<Eigen::ArrayXXd> shown;
      for (const int p : guide_.phases)
        shown.push_back(std::move(slice.images[static_cast<size_t>(p)]));
      slice.images = std::move(shown);
    }
  }

  void name_slices() {
    const auto height = [&](const CineSlice& slice) {
      return axis_.direction.dot(crossing_of(slice) - axis_.point);
    };
    std::stable_sort(slices_.begin(), slices_.end(), [&](const CineSlice& a, const CineSlice& b) {
      if (a.is_long != b.is_long) return b.is_long;
      return !a.is_long && height(a) < height(b);
    });
    size_t shorts = 0, longs = 0;
    for (CineSlice& slice : slices_)
      slice.name = slice.is_long ? fmt::format("la{}", longs++) : fmt::format("sa{:02}", shorts++);
  }

  /// Where the axis crosses a short-axis slice.
  [[nodiscard]] Vector3d crossing_of(const CineSlice& slice) const {
    const Vector3d n = slice.plane.normal();
    if (slice.is_long) return axis_.point;
    return axis_.point +
           axis_.direction * (n.dot(slice.plane.origin_mm - axis_.point) / n.dot(axis_.direction));
  }

  void add(size_t phase, size_t slice, GuideSurface surface, const Vector2d& mm) {
    guide_.points.push_back({phase, slice, surface, slices_[slice].plane.at(mm), edge_sigma_mm});
  }

  /// The lowest point of the base among those from a place on, along the axis; without any: infinity.
  [[nodiscard]] double base_height_mm(size_t from) const {
    double height = std::numeric_limits<double>::infinity();
    for (size_t i = from; i < guide_.points.size(); ++i)
      if (guide_.points[i].surface == GuideSurface::base)
        height = std::min(height, axis_.direction.dot(guide_.points[i].place_mm - axis_.point));
    return height;
  }

  void find_short(size_t phase, double base_mm) {
    std::vector<Contour> contours(slices_.size());
    for (size_t s = 0; s < slices_.size(); ++s) {
      const CineSlice& slice = slices_[s];
      // A slice that the base cuts, or nearly, shows two things at once.
      const double top_mm =
          axis_.direction.dot(crossing_of(slice) - axis_.point) + 0.5 * slice.plane.thickness_mm;
      if (slice.is_long || !slice.has(phase) || top_mm > base_mm) continue;
      Vector2d centre = on_image(slice.plane, crossing_of(slice));
      // The slice may be displaced: its centre is that of its contour.
      for (int i = 0; i < 3; ++i) {
        contours[s] = contour_from(slice, slice.images[phase], centre);
        if (contours[s].inner.size() < rays / 3) break;
        centre = mean_of(contours[s].inner);
      }
      // A few rays with something like a wall are chance.
      if (contours[s].inner.size() < rays / 3) contours[s] = {};
    }
    for (size_t s = 0; s + 1 < slices_.size(); ++s) {
      if (contours[s].inner.empty() || slices_[s + 1].is_long) continue;
      if (contours[s + 1].inner.empty()) continue;
      const double apart = std::abs(
          slices_[s].plane.normal().dot(slices_[s + 1].plane.origin_mm - slices_[s].plane.origin_mm));
      const auto is_upright = [&](const std::vector<Vector2d>& low, const std::vector<Vector2d>& high) {
        return radius_of(high) - radius_of(low) < 0.5 * apart;
      };
      if (is_upright(contours[s].inner, contours[s + 1].inner))
        put(phase, s, GuideSurface::endo, contours[s].inner);
      if (is_upright(contours[s].outer, contours[s + 1].outer))
        put(phase, s, GuideSurface::epi, contours[s].outer);
      const bool is_top = s + 2 == slices_.size() || slices_[s + 2].is_long || contours[s + 2].inner.empty();
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
    const CineSlice& slice = slices_[s];
    const Eigen::ArrayXXd& image = slice.images[phase];
    const Vector2d middle = on_image(slice.plane, axis_.point);
    const Vector2d up = (on_image(slice.plane, axis_.point + axis_.direction) - middle).normalized();
    // The apex of the cavity, from the middle of the blood downwards.
    const std::optional<WallOnRay> apex = wall_on_ray(slice, profile_of(slice, image, middle, -up));
    if (!apex) return;
    // Across the axis from the apex to above the base, and a fan about the apex.
    const Vector2d across(-up.y(), up.x());
    std::array<std::vector<WallOnRay>, 2> side;
    std::array<std::vector<double>, 2> height;
    for (double h = -0.5 * apex->inner_mm; h < ray_mm; h += 5) {
      for (size_t k = 0; k < 2; ++k) {
        const Vector2d direction = k == 0 ? across : Vector2d(-across);
        const std::optional<WallOnRay> wall =
            wall_on_ray(slice, profile_of(slice, image, middle + h * up, direction));
        if (!wall) continue;
        // Above the first gap nothing is the ventricle's.
        if (!height[k].empty() && h > height[k].back() + 7) continue;
        side[k].push_back(*wall);
        height[k].push_back(h);
      }
    }
    const Vector2d focus = middle - 0.7 * apex->inner_mm * up;
    for (int i = -4; i <= 4; ++i) {
      const double angle = i * std::numbers::pi / 10;
      const Vector2d direction = -std::cos(angle) * up + std::sin(angle) * across;
      const std::optional<WallOnRay> wall = wall_on_ray(slice, profile_of(slice, image, focus, direction));
      if (!wall) continue;
      add(phase, s, GuideSurface::endo, focus + wall->inner_mm * direction);
      add(phase, s, GuideSurface::epi, focus + wall->outer_mm * direction);
    }
    for (size_t k = 0; k < 2; ++k) {
      const Vector2d direction = k == 0 ? across : Vector2d(-across);
      // The last row may be blurred with what is above the base.
      for (size_t i = 0; i + 1 < side[k].size(); ++i) {
        const Vector2d on_axis = middle + height[k][i] * up;
        add(phase, s, GuideSurface::endo, on_axis + side[k][i].inner_mm * direction);
        add(phase, s, GuideSurface::epi, on_axis + side[k][i].outer_mm * direction);
      }
      if (side[k].size() > 1)
        find_base(phase, s, middle + (height[k].back() - 5) * up, direction, up, side[k][side[k].size() - 2]);
    }
  }

  /// Upwards through the wall, in three places of its thickness.
  void find_base(size_t phase, size_t s, const Vector2d& from, const Vector2d& outwards, const Vector2d& up,
                 const WallOnRay& wall) {
    const CineSlice& slice = slices_[s];
    for (const double part : {0.35, 0.5, 0.65}) {
      const Vector2d start = from + std::lerp(wall.inner_mm, wall.outer_mm, part) * outwards;
      const std::vector<double> profile = profile_of(slice, slice.images[phase], start, up);
      const std::optional<double> end = falls_through(profile, slice.levels.outer(), 0);
      if (end && *end < 25) add(phase, s, GuideSurface::base, start + *end * up);
    }
  }

  std::vector<CineSlice> slices_;
  Axis axis_{};
  GuidePoints guide_;
};

}  // namespace

GuidePoints cine_guide_points(const std::filesystem::path& folder,
                              const std::function<void(const std::string&)>& on_stage) {
  if (on_stage) on_stage(fmt::format("reading {}", folder.string()));
  const ImageFolder images = read_image_folder(folder);
  require_sound(images);
  if (on_stage) on_stage("finding walls in the images");
  return CineFinder(images, folder).found();
}

}  // namespace diastole::imaging
