#include "estimator/imaging/geometry/cines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "estimator/imaging/geometry/wall_rays.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Three means of all slices' grey values (Lloyd's iteration): a slice below the apex shows no blood of its own.
GreyLevels levels_of(const std::vector<CineSlice>& slices) {
  std::vector<double> values;
  for (const CineSlice& slice : slices)
    for (const Eigen::ArrayXXd& image : slice.images)
      values.insert(values.end(), image.data(), image.data() + image.size());
  std::sort(values.begin(), values.end());
  std::array<double, 3> mean{signal::quantile_of_sorted(values, 0.1), 0,
                             signal::quantile_of_sorted(values, 0.99)};
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

class CineReader {
 public:
  explicit CineReader(const ImageFolder& folder) {
    cines_.folder = folder.folder;
    cines_.findings = folder.problems;
    read_slices(folder);
    find_axis();
    name_slices();
    number_phases();
  }
  Cines done() { return std::move(cines_); }

 private:
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
        one.times_ms = times.times_ms;
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
          cines_.slices.push_back(std::move(one));
          continue;
        }
        cines_.findings.push_back(
            {Severity::warning, "other-phases",
             fmt::format("a slice of series {} has {} images, of which {} are at a time of the {} phases of "
                         "the others: it is left out",
                         series.number, pixels.size(), placed, phases),
             "", static_cast<double>(pixels.size()), "", "Export all phases of it."});
      }
    }
    const GreyLevels levels = cines_.slices.empty() ? GreyLevels{} : levels_of(cines_.slices);
    for (CineSlice& slice : cines_.slices)
      slice.levels = levels;
    if (cines_.slices.size() < 3)
      throw InputError({cines_.folder.string(), "",
                        fmt::format("has {} slice{} of cines, which makes no heart", cines_.slices.size(),
                                    cines_.slices.size() == 1 ? "" : "s"),
                        "Give the folder of a cine study: short-axis slices, and long-axis ones too."});
  }

  /// The short axis is the orientation that most slices have; the long-axis planes meet in the axis.
  void find_axis() {
    std::vector<size_t> alike(cines_.slices.size(), 0);
    for (size_t a = 0; a < cines_.slices.size(); ++a)
      for (const CineSlice& b : cines_.slices)
        if (std::abs(cines_.slices[a].plane.normal().dot(b.plane.normal())) > 0.99) ++alike[a];
    const auto most = static_cast<size_t>(std::max_element(alike.begin(), alike.end()) - alike.begin());
    const Vector3d across = cines_.slices[most].plane.normal();
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(3, 3);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(3);
    Vector3d middle = Vector3d::Zero();
    for (CineSlice& slice : cines_.slices) {
      const Vector3d n = slice.plane.normal();
      slice.is_long = std::abs(n.dot(across)) < std::sqrt(0.5);
      if (slice.is_long) {
        square += n * n.transpose();
        right += n * n.dot(slice.plane.origin_mm);
      }
      middle += centre_of_blood(slice) / static_cast<double>(cines_.slices.size());
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(square);
    cines_.axis_point_mm = middle;
    cines_.axis = across;
    // Two planes or more, of different directions.
    if (axes.eigenvalues()[1] > 0.1) {
      cines_.axis = axes.eigenvectors().col(0);
      const Eigen::VectorXd on_planes = square.completeOrthogonalDecomposition().solve(right);
      cines_.axis_point_mm = on_planes + cines_.axis * cines_.axis.dot(middle - on_planes.head<3>());
    }
    if (!points_to_base()) cines_.axis = -cines_.axis;
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
    for (const CineSlice& slice : cines_.slices) {
      const Vector2d centre = slice.plane.in_plane_mm(cines_.axis_point_mm);
      if (slice.is_long) {
        const Vector2d up =
            (slice.plane.in_plane_mm(cines_.axis_point_mm + cines_.axis) - centre).normalized();
        const auto closed = [&, image = fine_image(slice, slice.first_image())](const Vector2d& d) {
          return wall_on_ray(slice, profile_of(image, centre, d)).has_value();
        };
        votes += (closed(-up) ? 1 : 0) - (closed(up) ? 1 : 0);
      }
    }
    if (votes != 0) return votes > 0;
    double slope = 0;
    for (const CineSlice& slice : cines_.slices) {
      if (slice.is_long) continue;
      slope += cines_.height_mm(slice.plane.origin_mm) *
               static_cast<double>((slice.first_image() > slice.levels.inner()).count());
    }
    return slope > 0;
  }

  /// Those that some slice shows, by their numbers.
  void number_phases() {
    const size_t all = cines_.slices[0].images.size();
    for (size_t p = 0; p < all; ++p)
      if (std::ranges::any_of(cines_.slices, [&](const CineSlice& slice) { return slice.has(p); }))
        cines_.phases.push_back(static_cast<int>(p));
    if (cines_.phases.size() == all) return;
    for (CineSlice& slice : cines_.slices) {
      std::vector<Eigen::ArrayXXd> shown;
      std::vector<double> times_ms;
      for (const int p : cines_.phases) {
        shown.push_back(std::move(slice.images[static_cast<size_t>(p)]));
        times_ms.push_back(slice.times_ms[static_cast<size_t>(p)]);
      }
      slice.images = std::move(shown);
      slice.times_ms = std::move(times_ms);
    }
  }

  void name_slices() {
    const auto height = [&](const CineSlice& slice) { return cines_.height_mm(cines_.crossing_mm(slice)); };
    std::stable_sort(cines_.slices.begin(), cines_.slices.end(), [&](const CineSlice& a, const CineSlice& b) {
      if (a.is_long != b.is_long) return b.is_long;
      return !a.is_long && height(a) < height(b);
    });
    size_t shorts = 0, longs = 0;
    for (CineSlice& slice : cines_.slices)
      slice.name = slice.is_long ? fmt::format("la{}", longs++) : fmt::format("sa{:02}", shorts++);
  }

  Cines cines_;
};

}  // namespace

Vector3d Cines::crossing_mm(const CineSlice& slice) const {
  if (slice.is_long) return axis_point_mm;
  const Vector3d n = slice.plane.normal();
  return axis_point_mm + axis * (n.dot(slice.plane.origin_mm - axis_point_mm) / n.dot(axis));
}

Cines read_cines(const ImageFolder& folder) {
  require_sound(folder);
  return CineReader(folder).done();
}

}  // namespace diastole::imaging
