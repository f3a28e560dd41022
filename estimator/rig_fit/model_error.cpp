#include "estimator/rig_fit/model_error.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Smallest range of a segment, of its session's: where nothing moves the model errs too.
constexpr double least_range = 0.1;
/// A smooth function's harmonics: their squares sum to half of that of harmonic 0's amplitude.
double smooth_spectrum(double harmonic) { return 0.354 / std::pow(1.0 + harmonic, 1.5); }

ErrorGroup group_of(Signal signal, FeatureKind kind) {
  const bool transient = kind != FeatureKind::repeats;
  if (signal == Signal::cavity) return transient ? ErrorGroup::cavity_transient : ErrorGroup::cavity;
  if (signal == Signal::pump) return transient ? ErrorGroup::pump_transient : ErrorGroup::pump;
  return ErrorGroup::volume;
}

/// Size of what was measured at each harmonic of a block, over its range.
std::vector<double> amplitudes(const FeatureBlock& block, const VectorXd& measured, double range) {
  double highest = 0.0;
  for (const Feature& feature : block.features)
    if (feature.kind == FeatureKind::repeats) highest = std::max(highest, feature.harmonic);
  std::vector<double> found(static_cast<size_t>(highest) + 1, 0.0);
  for (size_t i = 0; i < block.features.size(); ++i) {
    const Feature& feature = block.features[i];
    if (feature.kind != FeatureKind::repeats || feature.harmonic == 0.0) continue;
    double& square = found[static_cast<size_t>(feature.harmonic)];
    const double value = measured[static_cast<Index>(block.first + i)];
    square += value * value * 2.0 / feature.rows / (range * range);
  }
  for (double& square : found)
    square = std::sqrt(square);
  return found;
}

double square(double x) { return x * x; }

}  // namespace

std::string_view name_of(ErrorGroup group) {
  constexpr std::array<std::string_view, error_groups> names{"cavity", "cavity_transient", "pump",
                                                             "pump_transient", "volume"};
  return names[static_cast<size_t>(group)];
}

VectorXd ModelError::variance(const Shares& shares) const {
  VectorXd sum = noise;
  for (Index i = 0; i < sum.size(); ++i)
    sum[i] += square(shares[static_cast<size_t>(group[static_cast<size_t>(i)])]) * unit[i];
  return sum;
}

ModelError model_error_of(const SegmentFeatures& features) {
  ModelError error;
  error.noise.resize(features.count());
  error.unit.resize(features.count());
  error.group.resize(static_cast<size_t>(features.count()));
  for (const FeatureBlock& block : features.blocks()) {
    double& range = error.range[static_cast<size_t>(block.signal)];
    range = std::max(range, block.range);
  }
  for (const FeatureBlock& block : features.blocks()) {
    const double range = std::max(block.range, least_range * error.range[static_cast<size_t>(block.signal)]);
    const std::vector<double> size = amplitudes(block, features.measured(), range);
    const auto near = [&](double harmonic) {
      const auto h = static_cast<size_t>(harmonic);
      double largest = h < size.size() ? size[h] : 0.0;
      if (h > 0 && h - 1 < size.size()) largest = std::max(largest, 0.5 * size[h - 1]);
      if (h + 1 < size.size()) largest = std::max(largest, 0.5 * size[h + 1]);
      return largest;
    };
    // Parts of the square of each kind, summing to one.
    std::array<double, 4> sums{};
    std::vector<double> parts;
    for (const Feature& feature : block.features) {
      const double part = square(near(feature.harmonic)) + square(smooth_spectrum(feature.harmonic));
      parts.push_back(part);
      sums[static_cast<size_t>(feature.kind)] += part * feature.rows;
    }
    double rows = 0.0;
    for (const Feature& feature : block.features)
      if (feature.kind == FeatureKind::repeats) rows = std::max(rows, feature.rows);
    for (size_t i = 0; i < block.features.size(); ++i) {
      const Feature& feature = block.features[i];
      const auto row = static_cast<Index>(block.first + i);
      // What single cycles show scatters over all of them; what sets in lives in one.
      const double lives_in = feature.kind == FeatureKind::first ? feature.rows : rows;
      error.noise[row] = square(feature.noise_sd);
      error.unit[row] =
          lives_in * square(range) * parts[i] * feature.rows / sums[static_cast<size_t>(feature.kind)];
      error.group[static_cast<size_t>(row)] = group_of(block.signal, feature.kind);
    }
  }
  return error;
}

Shares EvidenceFit::surprise(const SharePrior& prior) const {
  Shares sigmas{};
  for (size_t g = 0; g < error_groups; ++g) {
    const double logarithm = std::log(shares[g] / prior.share[g]);
    sigmas[g] = logarithm / (logarithm > 0.0 ? prior.up[g] : prior.down[g]);
  }
  return sigmas;
}

namespace {

/// As fit_linear, with the evidence's derivatives by the logarithms of the shares and their expected curvature.
struct Curvature {
  Shares slope{}, information{};
};

EvidenceFit solve(const VectorXd& z, const Eigen::MatrixXd& columns, const ModelError& error,
                  const Shares& shares, Curvature* curvature) {
  EvidenceFit fit;
  fit.shares = shares;
  fit.variance = error.variance(shares);
  const VectorXd weight = fit.variance.cwiseInverse();
  const Eigen::MatrixXd weighted = weight.asDiagonal() * columns;
  fit.precision = columns.transpose() * weighted;
  fit.precision.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXd> factor(fit.precision);
  fit.estimate = factor.solve(weighted.transpose() * z);
  fit.left = z - columns * fit.estimate;
  fit.chi_square = fit.left.cwiseAbs2().dot(weight) + fit.estimate.squaredNorm();
  const double determinant = 2.0 * factor.matrixLLT().diagonal().array().log().sum();
  fit.log_evidence = -0.5 * (fit.chi_square + determinant + fit.variance.array().log().sum());
  const Shares sigmas = fit.surprise(error.prior);
  for (const double sigma : sigmas)
    fit.log_evidence -= 0.5 * sigma * sigma;
  if (curvature == nullptr) return fit;
  // The inverse of D + K K' times z is left / D; its diagonal is 1/D less what the columns take.
  Eigen::MatrixXd explained = weighted.transpose();
  if (explained.size() > 0)
    factor.matrixL().solveInPlace(explained);  // nothing: a single waveform has no others
  for (Index i = 0; i < z.size(); ++i) {
    const auto g = static_cast<size_t>(error.group[static_cast<size_t>(i)]);
    const double models = square(shares[g]) * error.unit[i];
    const double diagonal = weight[i] - explained.col(i).squaredNorm();
    curvature->slope[g] += models * (square(fit.left[i] * weight[i]) - diagonal);
    curvature->information[g] += 2.0 * square(models * diagonal);
  }
  for (size_t g = 0; g < error_groups; ++g) {
    const double sd = sigmas[g] > 0.0 ? error.prior.up[g] : error.prior.down[g];
    curvature->slope[g] -= sigmas[g] / sd;
    curvature->information[g] += 1.0 / (sd * sd);
  }
  return fit;
}

}  // namespace

EvidenceFit fit_linear(const VectorXd& z, const Eigen::MatrixXd& columns, const ModelError& error,
                       const Shares& shares) {
  return solve(z, columns, error, shares, nullptr);
}

EvidenceFit fit_with_shares(const VectorXd& z, const Eigen::MatrixXd& columns, const ModelError& error,
                            const Shares& start) {
  constexpr int most_steps = 200;  // some forty where a rig without its effect errs by a tenth of the range
  constexpr double longest = 1.0;  // of a logarithm in a step
  constexpr double small = 0.01;   // nats, far below what decides anything
  Shares shares = start;
  for (size_t g = 0; g < error_groups; ++g)
    shares[g] = std::max(shares[g], SharePrior::least[g]);
  Curvature at;
  EvidenceFit fit = solve(z, columns, error, shares, &at);
  double part = 1.0;
  for (int step = 0; step < most_steps; ++step) {
    Shares next = shares;
    double promised = 0.0;
    for (size_t g = 0; g < error_groups; ++g) {
      const double wanted = std::clamp(part * at.slope[g] / at.information[g], -longest, longest);
      const double move = std::max(wanted, std::log(SharePrior::least[g] / shares[g]));
      promised += move * at.slope[g];
      next[g] *= std::exp(move);
    }
    if (promised < small) return fit;
    Curvature there;
    EvidenceFit tried = solve(z, columns, error, next, &there);
    if (tried.log_evidence > fit.log_evidence) {
      fit = std::move(tried);
      at = there;
      shares = next;
      part = std::min(1.0, 2.0 * part);
    } else {
      part *= 0.4;
      if (part < 1e-3) {
        fit.termination = inference::Termination::stalled;
        return fit;
      }
    }
  }
  fit.termination = inference::Termination::iteration_limit;
  return fit;
}

}  // namespace diastole::rig
