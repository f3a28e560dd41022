#include "estimator/imaging/tracking/image_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/imaging/tracking/brightness.hpp"
#include "estimator/imaging/tracking/robust_weight.hpp"

namespace diastole::imaging {
namespace {

/// The tags' phase a millimetre of motion.
double phase_per_mm(const TagWave& wave) { return 2 * std::numbers::pi * wave.per_mm.norm(); }

}  // namespace

std::array<double, 2> ImageFit::phases_at(const TissuePixel& pixel, size_t k,
                                          const SliceMotion& motion) const {
  std::array<double, 2> phases{};
  for (size_t f = 0; f < waves_.size(); ++f)
    phases[f] =
        waves_[f].phase_rad(pixel.x_mm) +
        phase_per_mm(waves_[f]) * spline_sum(pixel.splines, motion[f].col(static_cast<Eigen::Index>(k)));
  return phases;
}

TagPatterns ImageFit::patterns_at(const TissuePixel& pixel, size_t k, const SliceMotion& motion) const {
  return model_.at(phases_at(pixel, k, motion));
}

void ImageFit::explain(size_t k, const Image& image, const SliceMotion& motion, TrackedPhase& phase) {
  Brightness brightness(view_.extent_mm(), window_in_spacings * waves_[0].spacing_mm(),
                        static_cast<int>(model_.patterns()));
  fitted_.clear();
  for (const TissuePixel& pixel : pixels_) {
    if (static_cast<double>(phase.depth_mm(pixel.row, pixel.column)) < view_.sure_mm() ||
        view_.is_masked(k, pixel.row, pixel.column))
      continue;
    Fitted fitted{&pixel, phases_at(pixel, k, motion), {}, 0, {}};
    fitted.patterns = model_.at(fitted.phases);
    brightness.add(pixel.x_mm, fitted.patterns.values(), 1.0,
                   static_cast<double>(image(pixel.row, pixel.column)));
    fitted_.push_back(fitted);
  }
  brightness.solve(Brightness::Places::added);
  std::vector<double> residuals;
  phase.residual.setZero(image.rows(), image.cols());
  phase.slope.assign(waves_.size(), Eigen::ArrayXXf::Zero(image.rows(), image.cols()));
  std::array<double, TagPatterns::most> amplitudes{};
  for (Fitted& fitted : fitted_) {
    const TissuePixel& pixel = *fitted.pixel;
    fitted.residual = static_cast<double>(image(pixel.row, pixel.column)) -
                      brightness.picture(pixel.x_mm, fitted.patterns.values(), amplitudes);
    residuals.push_back(fitted.residual);
    phase.residual(pixel.row, pixel.column) = static_cast<float>(fitted.residual);
    for (size_t f = 0; f < waves_.size(); ++f) {
      fitted.slope[f] = phase_per_mm(waves_[f]) * model_.slope(fitted.phases, fitted.patterns, amplitudes, f);
      phase.slope[f](pixel.row, pixel.column) = static_cast<float>(fitted.slope[f]);
    }
  }
  phase.noise = std::max(robust_sigma(residuals), 1e-9);
  phase.pixels = fitted_.size();
}

double ImageFit::cost(double noise) const {
  double sum = 0;
  for (const Fitted& fitted : fitted_) {
    const double off = std::abs(fitted.residual) / noise;
    sum += off < huber_limit ? 0.5 * off * off : huber_limit * (off - 0.5 * huber_limit);
  }
  return sum;
}

PhaseInformation ImageFit::information(const TrackedPhase& phase, const ResidualExcess& excess,
                                       size_t direction, int splines) const {
  PhaseInformationSum sum(splines);
  for (const Fitted& fitted : fitted_) {
    const double beside_noise = excess.over_phases(phase, fitted.pixel->row, fitted.pixel->column);
    const double weight =
        huber_weight(fitted.residual, phase.noise) / (phase.noise * phase.noise * beside_noise);
    const double slope = fitted.slope[direction];
    sum.add(fitted.pixel->splines, weight * slope * slope, weight * slope * fitted.residual);
  }
  return sum.take();
}

}  // namespace diastole::imaging
