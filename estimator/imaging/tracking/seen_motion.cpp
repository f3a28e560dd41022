#include "estimator/imaging/tracking/seen_motion.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::imaging {
namespace {

/// A person sets a point on a line to half a pixel.
constexpr double seen_in_pixels = 0.5;

}  // namespace

SeenMotion::SeenMotion(const TagView& view, const std::vector<TagWave>& waves, const SplinePlane& splines)
    : sigma_mm_(seen_in_pixels * view.plane.finer_spacing_mm()),
      splines_(splines.count()),
      seen_(view.images.size(), std::vector<std::vector<Place>>(waves.size())) {
  for (size_t k = 0; k < view.edits.size(); ++k) {
    for (const SeenTag& seen : view.edits[k].seen) {
      const TagWave& wave = waves[static_cast<size_t>(seen.direction)];
      const double d_mm = (seen.tag + wave.offset_cycles) * wave.spacing_mm();
      seen_[k][static_cast<size_t>(seen.direction)].push_back(
          {splines.at(seen.x_mm), d_mm - wave.per_mm.normalized().dot(seen.x_mm)});
    }
  }
}

bool SeenMotion::is_led(size_t phase) const {
  return std::any_of(seen_[phase].begin(), seen_[phase].end(),
                     [](const auto& seen) { return !seen.empty(); });
}

PhaseInformation SeenMotion::information(size_t phase, size_t direction) const {
  PhaseInformationSum sum(splines_);
  for (const Place& seen : seen_[phase][direction])
    sum.add(seen.splines, 1 / (sigma_mm_ * sigma_mm_), seen.w_mm / (sigma_mm_ * sigma_mm_));
  return sum.take();
}

double SeenMotion::cost(size_t phase, size_t direction,
                        const Eigen::Ref<const Eigen::VectorXd>& coefficients) const {
  double sum = 0;
  for (const Place& seen : seen_[phase][direction])
    sum += 0.5 * std::pow((spline_sum(seen.splines, coefficients) - seen.w_mm) / sigma_mm_, 2);
  return sum;
}

}  // namespace diastole::imaging
