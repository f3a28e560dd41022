#include "estimator/imaging/tracking/rest_waves.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <numbers>

#include "estimator/imaging/tracking/brightness.hpp"
#include "estimator/imaging/tracking/robust_weight.hpp"
#include "estimator/imaging/tracking/tag_model.hpp"

namespace diastole::imaging {
namespace {

/// A motion that begins at rest has done 2 (2 t / T)^2 of its whole after a small t: a thousandth after a hundredth of the cycle.
constexpr double late_share = 0.02;

/// What the pixels of image k of at least this depth say of the waves, added to `matrix` and `vector`.
void add_information(const TagView& view, const std::vector<TagWave>& waves, size_t k,
                     const Eigen::ArrayXXf& depth, double least_mm, std::vector<Eigen::Matrix3d>& matrix,
                     std::vector<Eigen::Vector3d>& vector) {
  const TagModel model(waves.size());
  const Image& image = view.images[k];
  Brightness brightness(view.extent_mm(), window_in_spacings * view.waves[0].spacing_mm(),
                        static_cast<int>(model.patterns()));
  struct Sample {
    Eigen::Vector2d x_mm;
    std::array<double, 2> phases;
    TagPatterns patterns;
    double value;
  };
  std::vector<Sample> samples;
  for (Eigen::Index column = 0; column < image.cols(); ++column) {
    for (Eigen::Index row = 0; row < image.rows(); ++row) {
      if (static_cast<double>(depth(row, column)) < least_mm || view.is_masked(k, row, column)) continue;
      Sample sample{view.place_mm(row, column), {}, {}, static_cast<double>(image(row, column))};
      for (size_t f = 0; f < waves.size(); ++f)
        sample.phases[f] = waves[f].phase_rad(sample.x_mm);
      sample.patterns = model.at(sample.phases);
      brightness.add(sample.x_mm, sample.patterns.values(), 1.0, sample.value);
      samples.push_back(sample);
    }
  }
  if (samples.size() < 100) return;
  brightness.solve(Brightness::Places::added);
  std::vector<double> residuals;
  std::vector<std::array<double, TagPatterns::most>> amplitudes(samples.size());
  for (size_t i = 0; i < samples.size(); ++i)
    residuals.push_back(samples[i].value -
                        brightness.picture(samples[i].x_mm, samples[i].patterns.values(), amplitudes[i]));
  const double sigma = std::max(robust_sigma(residuals), 1e-9);
  const Eigen::Vector2d middle = 0.5 * view.extent_mm();
  for (size_t i = 0; i < samples.size(); ++i) {
    const double weight = huber_weight(residuals[i], sigma) / (sigma * sigma);
    for (size_t f = 0; f < waves.size(); ++f) {
      const double slope =
          2 * std::numbers::pi * model.slope(samples[i].phases, samples[i].patterns, amplitudes[i], f);
      Eigen::Vector3d row;
      row << slope * (samples[i].x_mm - middle) / view.extent_mm().norm(), slope;
      matrix[f] += weight * row * row.transpose();
      vector[f] += weight * residuals[i] * row;
    }
  }
}

}  // namespace

RestWaves waves_at_rest(const TagView& view, const MaterialMap& first) {
  RestWaves rest{view.waves, {}};
  std::vector<TagWave>& waves = rest.waves;
  const Eigen::ArrayXXf water = depth_mm(first, Material::still_water, view.plane);
  const Eigen::ArrayXXf tissue = depth_mm(first, Material::tissue, view.plane);
  const bool is_late = view.times_ms.front() > late_share * view.times_ms.back();
  for (int round = 0; round < 3; ++round) {
    std::vector<Eigen::Matrix3d> matrix(waves.size(), Eigen::Matrix3d::Zero());
    std::vector<Eigen::Vector3d> vector(waves.size(), Eigen::Vector3d::Zero());
    for (size_t k = 0; k < view.images.size(); ++k) {
      if (is_late) add_information(view, waves, k, water, 2.5 * view.sure_mm(), matrix, vector);
      if (k == 0) add_information(view, waves, k, tissue, 1.5 * view.sure_mm(), matrix, vector);
    }
    for (size_t f = 0; f < waves.size(); ++f) {
      const Eigen::Vector3d step = matrix[f].ldlt().solve(vector[f]);
      if (!step.allFinite()) continue;
      const Eigen::Vector2d middle = 0.5 * view.extent_mm();
      waves[f].per_mm += step.head<2>() / view.extent_mm().norm();
      waves[f].offset_cycles += step.head<2>().dot(middle) / view.extent_mm().norm() - step[2];
    }
    rest.information = matrix;
  }
  return rest;
}

}  // namespace diastole::imaging
