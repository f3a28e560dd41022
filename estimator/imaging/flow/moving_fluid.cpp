#include "estimator/imaging/flow/moving_fluid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

/// A phase is measurable where the magnitude is three times the noise: its error is then a third of a radian.
constexpr double least_signal = 3.0;
/// Length of the mean of unit vectors: still material at that signal reaches 0.94, noise 1 / sqrt(phases).
constexpr double steady = 0.9;
/// Fewer pixels than this are no lumen whose edge could be found.
constexpr size_t least_region = 9;

/// The quantile of a chi-square variable over its degrees of freedom, z standard deviations up (Wilson and Hilferty, PNAS 17 (1931) 684).
double chi_square_ratio(double z, double freedom) {
  const double third = 2.0 / (9.0 * freedom);
  const double root = 1 - third + z * std::sqrt(third);
  return root * root * root;
}

std::complex<double> polar(float magnitude, float phase) {
  return std::polar(static_cast<double>(magnitude), static_cast<double>(phase));
}

}  // namespace

double within_half_turn(double radians) {
  return radians - 2 * std::numbers::pi * std::round(radians / (2 * std::numbers::pi));
}

bool MotionMap::has_signal(Eigen::Index pixel) const {
  return static_cast<double>(mean_magnitude.data()[pixel]) > least_signal * noise.magnitude_times_phase;
}
double MotionMap::moving_from() const { return chi_square_ratio(4.75, static_cast<double>(phases - 1)); }
double MotionMap::still_below() const { return chi_square_ratio(3.09, static_cast<double>(phases - 1)); }

MotionMap motion_map(const PhaseContrast& scan) {
  MotionMap map;
  map.phases = scan.phases();
  const Eigen::Index rows = scan.magnitude[0].rows(), columns = scan.magnitude[0].cols();
  const auto count = static_cast<double>(scan.phases());
  map.mean_magnitude = map.mean_phase = map.activity = Image::Zero(rows, columns);
  Image steadiness = Image::Zero(rows, columns);
  Image spread = Image::Zero(rows, columns);
  for (Eigen::Index i = 0; i < map.activity.size(); ++i) {
    std::complex<double> sum = 0;
    double total = 0, squares = 0;
    for (size_t k = 0; k < scan.phases(); ++k) {
      const float magnitude = scan.magnitude[k].data()[i];
      sum += polar(magnitude, scan.phase_rad[k].data()[i]);
      total += static_cast<double>(magnitude);
      squares += static_cast<double>(magnitude) * static_cast<double>(magnitude);
    }
    const double phase = std::arg(sum);
    double activity = 0;
    for (size_t k = 0; k < scan.phases(); ++k) {
      const double apart = static_cast<double>(scan.magnitude[k].data()[i]) *
                           within_half_turn(static_cast<double>(scan.phase_rad[k].data()[i]) - phase);
      activity += apart * apart / (count - 1);
    }
    map.mean_magnitude.data()[i] = static_cast<float>(total / count);
    map.mean_phase.data()[i] = static_cast<float>(phase);
    map.activity.data()[i] = static_cast<float>(activity);
    steadiness.data()[i] = static_cast<float>(total > 0 ? std::abs(sum) / total : 0);
    spread.data()[i] = static_cast<float>((squares - total * total / count) / (count - 1));
  }
  // Noise from what is steady, the median so that moving pixels among them do not count.
  std::vector<double> products, magnitudes;
  for (Eigen::Index i = 0; i < map.activity.size(); ++i) {
    if (static_cast<double>(steadiness.data()[i]) < steady) continue;
    products.push_back(static_cast<double>(map.activity.data()[i]));
    magnitudes.push_back(static_cast<double>(spread.data()[i]));
  }
  if (products.size() < 2) return map;
  const double median_of_one = chi_square_ratio(0, count - 1);
  map.noise.magnitude_times_phase = std::sqrt(signal::median(std::move(products)) / median_of_one);
  map.noise.magnitude = std::sqrt(signal::median(std::move(magnitudes)) / median_of_one);
  const double variance = map.noise.magnitude_times_phase * map.noise.magnitude_times_phase;
  if (variance > 0) map.activity /= static_cast<float>(variance);
  return map;
}

Eigen::Vector2d measured_share(const PhaseContrast& scan, const MotionMap& map,
                               const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& still) {
  constexpr int lags = 3;
  // So many pairs determine a correlation to a hundredth.
  constexpr double least_pairs = 1e4;
  Eigen::Vector2d shares(1, 1);
  const Eigen::Index rows = still.rows(), columns = still.cols();
  const auto noise = [&](size_t k, Eigen::Index row, Eigen::Index column) {
    return static_cast<double>(scan.magnitude[k](row, column)) *
           within_half_turn(static_cast<double>(scan.phase_rad[k](row, column)) -
                            static_cast<double>(map.mean_phase(row, column)));
  };
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    std::array<double, lags + 1> products{}, pairs{};
    for (size_t k = 0; k < scan.phases(); ++k) {
      for (Eigen::Index column = 0; column < columns; ++column) {
        for (Eigen::Index row = 0; row < rows; ++row) {
          if (!still(row, column)) continue;
          const double here = noise(k, row, column);
          for (Eigen::Index lag = 0; lag <= lags; ++lag) {
            const Eigen::Index r = row + (axis == 1 ? lag : 0), c = column + (axis == 0 ? lag : 0);
            if (r >= rows || c >= columns || !still(r, c)) continue;
            products[static_cast<size_t>(lag)] += here * noise(k, r, c);
            pairs[static_cast<size_t>(lag)] += 1;
          }
        }
      }
    }
    if (pairs[lags] < least_pairs || !(products[0] > 0)) continue;
    double least = std::numeric_limits<double>::infinity();
    for (double share = 0.3; share <= 1.0 + 1e-9; share += 0.005) {
      double squares = 0;
      for (size_t lag = 1; lag <= lags; ++lag) {
        const double angle = std::numbers::pi * share * static_cast<double>(lag);
        const double alike = products[lag] / pairs[lag] / (products[0] / pairs[0]);
        squares += std::pow(alike - std::sin(angle) / angle, 2);
      }
      if (squares >= least) continue;
      least = squares;
      shares[axis] = share;
    }
  }
  return shares;
}

std::vector<MovingRegion> moving_regions(const MotionMap& map) {
  const Eigen::Index rows = map.activity.rows(), columns = map.activity.cols();
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> open(rows, columns);
  for (Eigen::Index i = 0; i < map.activity.size(); ++i)
    open.data()[i] = map.has_signal(i) && static_cast<double>(map.activity.data()[i]) > map.moving_from();
  std::vector<MovingRegion> regions;
  for (Eigen::Index column = 0; column < columns; ++column) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      if (!open(row, column)) continue;
      MovingRegion region;
      std::vector<Eigen::Vector2i> waiting{{static_cast<int>(column), static_cast<int>(row)}};
      open(row, column) = false;
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      while (!waiting.empty()) {
        const Eigen::Vector2i at = waiting.back();
        waiting.pop_back();
        region.pixels.push_back(at);
        sum += at.cast<double>();
        for (const Eigen::Vector2i& way :
             {Eigen::Vector2i(1, 0), Eigen::Vector2i(-1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(0, -1)}) {
          const Eigen::Vector2i next = at + way;
          if (next.x() < 0 || next.y() < 0 || next.x() >= columns || next.y() >= rows) continue;
          if (!open(next.y(), next.x())) continue;
          open(next.y(), next.x()) = false;
          waiting.push_back(next);
        }
      }
      if (region.pixels.size() < least_region) continue;
      region.centre = sum / static_cast<double>(region.pixels.size());
      region.radius_px = std::sqrt(static_cast<double>(region.pixels.size()) / std::numbers::pi);
      regions.push_back(std::move(region));
    }
  }
  std::stable_sort(regions.begin(), regions.end(), [](const MovingRegion& a, const MovingRegion& b) {
    return a.pixels.size() > b.pixels.size();
  });
  return regions;
}

Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> still_pixels(const MotionMap& map,
                                                                const std::vector<MovingRegion>& regions,
                                                                int clear_px) {
  const Eigen::Index rows = map.activity.rows(), columns = map.activity.cols();
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> still(rows, columns);
  for (Eigen::Index i = 0; i < map.activity.size(); ++i)
    still.data()[i] = map.has_signal(i) && static_cast<double>(map.activity.data()[i]) < map.still_below();
  // Where a neighbour has no signal the pixel is an edge, which rings.
  const auto bright = still;
  for (Eigen::Index column = 0; column < columns; ++column)
    for (Eigen::Index row = 0; row < rows; ++row)
      for (Eigen::Index c = std::max<Eigen::Index>(0, column - 1); c <= std::min(columns - 1, column + 1);
           ++c)
        for (Eigen::Index r = std::max<Eigen::Index>(0, row - 1); r <= std::min(rows - 1, row + 1); ++r)
          still(row, column) = still(row, column) && (bright(r, c) || map.has_signal(r + c * rows));
  for (const MovingRegion& region : regions) {
    for (const Eigen::Vector2i& at : region.pixels) {
      for (Eigen::Index c = std::max(0, at.x() - clear_px);
           c <= std::min<Eigen::Index>(columns - 1, at.x() + clear_px); ++c)
        for (Eigen::Index r = std::max(0, at.y() - clear_px);
             r <= std::min<Eigen::Index>(rows - 1, at.y() + clear_px); ++r)
          still(r, c) = false;
    }
  }
  return still;
}

}  // namespace diastole::imaging
