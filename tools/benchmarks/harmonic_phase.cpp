#include "tools/benchmarks/harmonic_phase.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace diastole {
namespace {

using namespace imaging;

/// -H at a place.
std::complex<double> dark_line(const Image& image, const SlicePlane& plane, const TagWave& wave,
                               const Eigen::Vector2d& x_mm) {
  // exp(-(f/s)^2/2) in frequency with s = k/4 is exp(-(2 pi s d)^2/2) in space.
  const double decay = 2 * std::numbers::pi * wave.per_mm.norm() / 4;
  const double reach_mm = 3 / decay;
  const auto first = [&](double at_mm, double spacing_mm) {
    return std::max<Eigen::Index>(0, static_cast<Eigen::Index>(std::ceil((at_mm - reach_mm) / spacing_mm)));
  };
  const auto last = [&](double at_mm, double spacing_mm, int count) {
    return std::min<Eigen::Index>(count - 1,
                                  static_cast<Eigen::Index>(std::floor((at_mm + reach_mm) / spacing_mm)));
  };
  std::complex<double> sum = 0;
  for (Eigen::Index c = first(x_mm.x(), plane.column_spacing_mm);
       c <= last(x_mm.x(), plane.column_spacing_mm, plane.columns); ++c) {
    for (Eigen::Index r = first(x_mm.y(), plane.row_spacing_mm);
         r <= last(x_mm.y(), plane.row_spacing_mm, plane.rows); ++r) {
      const Eigen::Vector2d d(static_cast<double>(c) * plane.column_spacing_mm - x_mm.x(),
                              static_cast<double>(r) * plane.row_spacing_mm - x_mm.y());
      sum -= static_cast<double>(image(r, c)) * std::polar(std::exp(-0.5 * decay * decay * d.squaredNorm()),
                                                           -2 * std::numbers::pi * wave.per_mm.dot(d));
    }
  }
  return sum;
}

}  // namespace

std::optional<double> harmonic_line_mm(const Image& image, const SlicePlane& plane, const TagWave& wave,
                                       const Eigen::Vector2d& x_mm) {
  const Eigen::Vector2d normal = wave.per_mm.normalized();
  const double radians_per_mm = 2 * std::numbers::pi * wave.per_mm.norm();
  double along_mm = 0;
  for (int step = 0; step < 8; ++step) {
    const double off_mm = std::arg(dark_line(image, plane, wave, x_mm + along_mm * normal)) / radians_per_mm;
    along_mm -= off_mm;
    if (std::abs(along_mm) > wave.spacing_mm()) return std::nullopt;
    if (std::abs(off_mm) < 1e-4) return along_mm;
  }
  return along_mm;
}

}  // namespace diastole
