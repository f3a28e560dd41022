#include "host/config/even_waveform.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace diastole {
namespace {

constexpr double evenness = 1e-6;
constexpr size_t usual_grid = 2048;

/// The monotone cubic through the points.
class Curve {
 public:
  explicit Curve(const PointsFile& points) : points_(points) {
    const size_t intervals = points.phase.size() - 1;
    for (size_t i = 0; i <= intervals; ++i) {
      const size_t left = (i + intervals - 1) % intervals, right = i % intervals;
      const double s0 = secant(left), s1 = secant(right), h0 = width(left), h1 = width(right);
      const double most = 3 * std::min(std::abs(s0), std::abs(s1));
      slope_.push_back(s0 * s1 <= 0 ? 0 : std::clamp((h1 * s0 + h0 * s1) / (h0 + h1), -most, most));
    }
  }

  [[nodiscard]] double at(double phase) const {
    const auto after = std::upper_bound(points_.phase.begin() + 1, points_.phase.end() - 1, phase);
    const auto i = static_cast<size_t>(after - points_.phase.begin()) - 1;
    const double h = width(i), u = (phase - points_.phase[i]) / h;
    return points_.fraction[i] + (points_.fraction[i + 1] - points_.fraction[i]) * u * u * (3 - 2 * u) +
           h * u * (1 - u) * (slope_[i] * (1 - u) - slope_[i + 1] * u);
  }

 private:
  [[nodiscard]] double width(size_t i) const { return points_.phase[i + 1] - points_.phase[i]; }
  [[nodiscard]] double secant(size_t i) const {
    return (points_.fraction[i + 1] - points_.fraction[i]) / width(i);
  }

  const PointsFile& points_;
  std::vector<double> slope_;
};

bool is_extreme(const PointsFile& points, size_t i) {
  if (i == 0 || i + 1 == points.phase.size()) return true;
  const double rise = points.fraction[i] - points.fraction[i - 1];
  return rise * (points.fraction[i + 1] - points.fraction[i]) <= 0;
}

/// How far the worst extreme point, and the worst of all, lie from a grid's phases.
std::pair<double, double> distance(const PointsFile& points, size_t grid) {
  double extreme = 0, any = 0;
  for (size_t i = 0; i < points.phase.size(); ++i) {
    const double place = points.phase[i] * static_cast<double>(grid);
    const double off = std::abs(place - std::round(place)) / static_cast<double>(grid);
    any = std::max(any, off);
    if (is_extreme(points, i)) extreme = std::max(extreme, off);
  }
  return {extreme, any};
}

size_t best_grid(const PointsFile& points, size_t room) {
  const size_t most = std::min(room, std::max(usual_grid, points.phase.size()));
  size_t best = most;
  std::pair<double, double> least{1, 1};
  for (size_t grid = most; grid > most / 2; --grid) {
    auto off = distance(points, grid);
    // Nearer than a written phase is exact counts as met.
    off.first = off.first < evenness ? 0 : off.first;
    off.second = off.second < evenness ? 0 : off.second;
    if (off >= least) continue;
    least = off;
    best = grid;
  }
  return best;
}

std::vector<int16_t> rises_of(const std::vector<double>& fraction) {
  double largest = 0;
  for (size_t i = 1; i < fraction.size(); ++i)
    largest = std::max(largest, std::abs(fraction[i] - fraction[i - 1]));
  const double scale = std::floor(32766 / largest);
  std::vector<int16_t> rises;
  for (size_t i = 1; i < fraction.size(); ++i)
    rises.push_back(
        static_cast<int16_t>(std::lround(scale * fraction[i]) - std::lround(scale * fraction[i - 1])));
  return rises;
}

}  // namespace

std::vector<double> EvenWaveform::fractions() const {
  std::vector<double> heights{0};
  for (const int16_t rise : rises)
    heights.push_back(heights.back() + rise);
  const double stroke = std::ranges::max(heights);
  for (double& height : heights)
    height /= stroke;
  return heights;
}

size_t even_points(const PointsFile& points) {
  const size_t intervals = points.phase.size() - 1;
  for (size_t i = 0; i <= intervals; ++i) {
    const double even = static_cast<double>(i) / static_cast<double>(intervals);
    if (std::abs(points.phase[i] - even) > evenness) return 0;
  }
  return intervals;
}

std::vector<double> curve_at_even_phases(const PointsFile& points, size_t count) {
  const Curve curve(points);
  std::vector<double> fraction;
  for (size_t i = 0; i < count; ++i)
    fraction.push_back(curve.at(static_cast<double>(i) / static_cast<double>(count)));
  return fraction;
}

EvenWaveform on_even_phases(const PointsFile& points, size_t room) {
  if (even_points(points) > 0) return {rises_of(points.fraction), 0};
  const size_t grid = best_grid(points, room);
  std::vector<double> fraction = curve_at_even_phases(points, grid);
  fraction.push_back(0);
  const double off = distance(points, grid).second;
  return {rises_of(fraction), off < evenness ? 0 : off};
}

}  // namespace diastole
