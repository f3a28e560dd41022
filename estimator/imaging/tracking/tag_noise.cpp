#include "estimator/imaging/tracking/tag_noise.hpp"

#include <algorithm>

#include "estimator/imaging/series/spectrum.hpp"
#include "estimator/imaging/tracking/robust_weight.hpp"

namespace diastole::imaging {

double power_near_tags(const TrackedPhase& phase, const ResidualExcess& excess, const SlicePlane& plane,
                       const TagWave& wave, double spacing_mm) {
  const Eigen::Vector2d extent(plane.columns * plane.column_spacing_mm, plane.rows * plane.row_spacing_mm);
  const auto limit = static_cast<float>(huber_limit * phase.noise);
  double pixels = 0;
  Image clean = Image::Zero(phase.residual.rows(), phase.residual.cols());
  for (Eigen::Index column = 0; column < clean.cols(); ++column) {
    for (Eigen::Index row = 0; row < clean.rows(); ++row) {
      if (phase.residual(row, column) == 0 || !excess.is_clean(row, column)) continue;
      clean(row, column) = std::clamp(phase.residual(row, column), -limit, limit);
      pixels += 1;
    }
  }
  const Eigen::ArrayXXf power = spectrum_of(clean).abs2();
  double sum = 0, count = 0;
  for (Eigen::Index column = 0; column < power.cols(); ++column) {
    for (Eigen::Index row = 0; row < power.rows(); ++row) {
      const Eigen::Vector2d per_mm(signed_bin(column, power.cols()) / extent.x(),
                                   signed_bin(row, power.rows()) / extent.y());
      const double apart = (per_mm - wave.per_mm).norm() * spacing_mm;
      if (apart < 0.4 || apart > 0.65) continue;
      sum += static_cast<double>(power(row, column));
      count += 1;
    }
  }
  return sum / (std::max(count, 1.0) * std::max(pixels, 1.0) * phase.noise * phase.noise);
}

}  // namespace diastole::imaging
