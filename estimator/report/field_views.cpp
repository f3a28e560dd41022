#include "estimator/report/field_views.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "estimator/report/html_text.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::report {
namespace {

using explain::FieldResidual;
using Place = std::array<double, 3>;

constexpr size_t layers = 3, turns = 60, heights = 30, depths = 12;
constexpr double least_residuals = 4.0;

size_t cell(double part, size_t cells) {
  return std::min(cells - 1, static_cast<size_t>(std::max(0.0, part) * static_cast<double>(cells)));
}

double middle_of(size_t cell, size_t cells) {
  return (static_cast<double>(cell) + 0.5) / static_cast<double>(cells);
}

/// The wall's inner and outer radius are those of the residuals at the same height.
class Wall {
 public:
  explicit Wall(const std::vector<FieldResidual>& residuals) {
    for (const FieldResidual& r : residuals) {
      low_mm_ = std::min(low_mm_, r.place_mm[2]);
      high_mm_ = std::max(high_mm_, r.place_mm[2]);
    }
    for (const FieldResidual& r : residuals) {
      const double radius_mm = std::hypot(r.place_mm[0], r.place_mm[1]);
      Band& band = bands_[band_of(r.place_mm[2])];
      band.inner_mm = std::min(band.inner_mm, radius_mm);
      band.outer_mm = std::max(band.outer_mm, radius_mm);
    }
    double thickest_mm = 0.0;
    for (const Band& band : bands_)
      thickest_mm = std::max(thickest_mm, band.outer_mm - band.inner_mm);
    constexpr double share = 0.3;
    window_mm_ = std::max(share * thickest_mm, 1e-9);
  }

  [[nodiscard]] double low_mm() const { return low_mm_; }
  [[nodiscard]] double high_mm() const { return high_mm_; }
  /// Standard deviation of the weights around a place.
  [[nodiscard]] double window_mm() const { return window_mm_; }

  /// 0 at the lowest residual, 1 at the highest.
  [[nodiscard]] double height_of(double z_mm) const {
    return (z_mm - low_mm_) / std::max(high_mm_ - low_mm_, 1e-9);
  }
  /// 0 at the cavity, 1 outside.
  [[nodiscard]] double depth_of(const Place& place_mm) const {
    const Band& band = bands_[band_of(place_mm[2])];
    return (std::hypot(place_mm[0], place_mm[1]) - band.inner_mm) /
           std::max(band.outer_mm - band.inner_mm, 1e-9);
  }
  /// `turn` from 0 at -180 degrees to 1.
  [[nodiscard]] Place place_mm(double turn, double depth, double z_mm) const {
    const Band& band = bands_[band_of(z_mm)];
    const double radius_mm = std::lerp(band.inner_mm, band.outer_mm, depth);
    const double theta = 2.0 * std::numbers::pi * (turn - 0.5);
    return {radius_mm * std::cos(theta), radius_mm * std::sin(theta), z_mm};
  }

 private:
  struct Band {
    double inner_mm = std::numeric_limits<double>::infinity();
    double outer_mm = 0.0;
  };
  [[nodiscard]] size_t band_of(double z_mm) const { return cell(height_of(z_mm), bands_.size()); }

  double low_mm_ = std::numeric_limits<double>::infinity();
  double high_mm_ = -low_mm_;
  double window_mm_ = 1.0;
  std::array<Band, 12> bands_;
};

/// Misfit over noise around a place, before and after.
class Misfits {
 public:
  Misfits(const std::vector<FieldResidual>& residuals, double window_mm)
      : sorted_(residuals), window_mm_(window_mm) {
    std::ranges::sort(sorted_, {}, height);
  }

  [[nodiscard]] std::array<double, 2> around(const Place& place_mm) const {
    const double reach_mm = 2.5 * window_mm_;
    const auto first = std::ranges::lower_bound(sorted_, place_mm[2] - reach_mm, {}, height);
    const auto last = std::ranges::upper_bound(sorted_, place_mm[2] + reach_mm, {}, height);
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    Eigen::Vector3d after = Eigen::Vector3d::Zero();
    double weights = 0.0;
    for (const FieldResidual& r : std::span(first, last)) {
      double square_mm2 = 0.0;
      for (size_t k = 0; k < 3; ++k)
        square_mm2 += (r.place_mm[k] - place_mm[k]) * (r.place_mm[k] - place_mm[k]);
      if (square_mm2 > reach_mm * reach_mm) continue;
      const double weight = std::exp(-0.5 * square_mm2 / (window_mm_ * window_mm_));
      const Eigen::Vector3d by = weight * Eigen::Vector3d(r.per_mm[0], r.per_mm[1], r.per_mm[2]);
      before += r.before * by;
      after += r.after * by;
      spread += by * by.transpose();
      weights += weight;
    }
    const Eigen::LDLT<Eigen::Matrix3d> factor(spread);
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    if (weights < least_residuals || !(factor.rcond() > 1e-6)) return {none, none};
    return {std::sqrt(before.dot(factor.solve(before)) / 3.0),
            std::sqrt(after.dot(factor.solve(after)) / 3.0)};
  }

 private:
  static double height(const FieldResidual& r) { return r.place_mm[2]; }

  std::vector<FieldResidual> sorted_;
  double window_mm_;
};

/// `place_of(row, column)` is the middle of a cell.
template <class PlaceOf>
void fill(FieldView& view, size_t rows, const Misfits& misfits, const PlaceOf& place_of) {
  view.before.assign(rows, std::vector<double>(turns));
  view.after = view.before;
  for (size_t row = 0; row < rows; ++row) {
    for (size_t column = 0; column < turns; ++column) {
      const std::array<double, 2> misfit = misfits.around(place_of(row, column));
      view.before[row][column] = misfit[0];
      view.after[row][column] = misfit[1];
    }
  }
}

double degrees_of(const Place& place_mm) { return std::atan2(place_mm[1], place_mm[0]) / rad_per_deg; }

FieldView unrolled(size_t layer, const Wall& wall, const Misfits& misfits,
                   const std::vector<Place>& marked_mm) {
  constexpr std::array<const char*, layers> names{"inner", "middle", "outer"};
  FieldView view;
  view.title = fmt::format("The {} third of the wall, unrolled", names[layer]);
  view.y_range = {wall.high_mm(), wall.low_mm()};
  view.y_label = "z (mm)";
  const double depth = middle_of(layer, layers);
  fill(view, heights, misfits, [&](size_t row, size_t column) {
    return wall.place_mm(middle_of(column, turns), depth,
                         std::lerp(wall.high_mm(), wall.low_mm(), middle_of(row, heights)));
  });
  for (const Place& place_mm : marked_mm)
    if (cell(wall.depth_of(place_mm), layers) == layer)
      view.marks.push_back({degrees_of(place_mm), place_mm[2]});
  return view;
}

FieldView across(double z_mm, const Wall& wall, const Misfits& misfits, const std::vector<Place>& marked_mm) {
  FieldView view;
  view.title =
      fmt::format("Across the axis at z = {} mm, from the cavity (0) to the outside (1)", number(z_mm, 2));
  view.y_range = {1.0, 0.0};
  view.y_label = "depth in the wall";
  fill(view, depths, misfits, [&](size_t row, size_t column) {
    return wall.place_mm(middle_of(column, turns), 1.0 - middle_of(row, depths), z_mm);
  });
  for (const Place& place_mm : marked_mm)
    if (std::abs(place_mm[2] - z_mm) < wall.window_mm())
      view.marks.push_back({degrees_of(place_mm), std::clamp(wall.depth_of(place_mm), 0.0, 1.0)});
  return view;
}

}  // namespace

std::vector<FieldView> field_views(const std::vector<FieldResidual>& residuals,
                                   const std::vector<Place>& marked_mm) {
  const Wall wall(residuals);
  const Misfits misfits(residuals, wall.window_mm());
  std::vector<FieldView> views;
  double worst = 0.0;
  double worst_height = 0.5;
  for (size_t layer = 0; layer < layers; ++layer) {
    views.push_back(unrolled(layer, wall, misfits, marked_mm));
    for (size_t row = 0; row < heights; ++row) {
      for (const double value : views.back().before[row]) {
        if (!(value > worst)) continue;
        worst = value;
        worst_height = 1.0 - middle_of(row, heights);
      }
    }
  }
  views.push_back(across(std::lerp(wall.low_mm(), wall.high_mm(), worst_height), wall, misfits, marked_mm));
  return views;
}

std::array<double, 2> rms_of(const std::vector<FieldResidual>& residuals) {
  std::array<double, 2> sum{};
  for (const FieldResidual& r : residuals) {
    sum[0] += r.before * r.before;
    sum[1] += r.after * r.after;
  }
  const auto count = static_cast<double>(std::max<size_t>(residuals.size(), 1));
  return {std::sqrt(sum[0] / count), std::sqrt(sum[1] / count)};
}

}  // namespace diastole::report
