#include "estimator/imaging/flow/periodic_regression.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace diastole::imaging {
namespace {

/// Harmonics in terms of the values' own bandwidth: what lies beyond is a small part of the prior's variance.
constexpr Eigen::Index bandwidths = 4;
constexpr double smoothest = 4.0;

double angular(double period_s, Eigen::Index harmonic) {
  return 2 * std::numbers::pi * static_cast<double>(harmonic) / period_s;
}

/// One row of pairs, from `pair(omega, t)` of each harmonic.
template <class Pair>
Eigen::VectorXd row_of(double period_s, Eigen::Index size, double first, const Pair& pair) {
  Eigen::VectorXd row(size);
  row[0] = first;
  for (Eigen::Index k = 1; 2 * k < size; ++k) {
    const auto [a, b] = pair(angular(period_s, k));
    row[2 * k - 1] = a;
    row[2 * k] = b;
  }
  return row;
}

/// Variances relative to s^2; of the mean far more than any flow has.
Eigen::VectorXd prior_of(Eigen::Index size, double smoothness) {
  Eigen::VectorXd prior(size);
  prior[0] = 1e4;
  for (Eigen::Index k = 1; 2 * k < size; ++k)
    prior[2 * k - 1] = prior[2 * k] = std::pow(static_cast<double>(k), -2 * smoothness);
  return prior;
}

struct Regression {
  double log_evidence;
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;
};

Regression regressed(const Eigen::MatrixXd& design, const Eigen::VectorXd& values,
                     const Eigen::MatrixXd& errors, const Eigen::VectorXd& prior, bool in_full) {
  const Eigen::MatrixXd spread = prior.asDiagonal() * design.transpose();
  const Eigen::MatrixXd total = design * spread + errors;
  const Eigen::LLT<Eigen::MatrixXd> factor(total);
  Regression result;
  const Eigen::VectorXd solved = factor.solve(values);
  result.log_evidence =
      -0.5 * values.dot(solved) - Eigen::MatrixXd(factor.matrixL()).diagonal().array().log().sum();
  if (!in_full) return result;
  result.coefficients = spread * solved;
  result.covariance = -spread * factor.solve(spread.transpose());
  result.covariance += prior.asDiagonal();
  return result;
}

}  // namespace

Eigen::VectorXd PeriodicRegression::value_row(double t) const {
  return row_of(period_s, coefficients.size(), 1.0,
                [t](double w) { return std::pair(std::cos(w * t), std::sin(w * t)); });
}
Eigen::VectorXd PeriodicRegression::slope_row(double t) const {
  return row_of(period_s, coefficients.size(), 0.0,
                [t](double w) { return std::pair(-w * std::sin(w * t), w * std::cos(w * t)); });
}
Eigen::VectorXd PeriodicRegression::integral_row(double t) const {
  return row_of(period_s, coefficients.size(), t,
                [t](double w) { return std::pair(std::sin(w * t) / w, (1 - std::cos(w * t)) / w); });
}
double PeriodicRegression::sigma_of(const Eigen::VectorXd& row) const {
  return std::sqrt(std::max(0.0, row.dot(covariance * row)));
}

PeriodicRegression periodic_regression(const Eigen::VectorXd& time_s, const Eigen::VectorXd& values,
                                       const Eigen::MatrixXd& covariance, double period_s) {
  PeriodicRegression curve;
  curve.period_s = period_s;
  const Eigen::Index size = 1 + bandwidths * values.size();
  curve.coefficients = Eigen::VectorXd::Zero(size);
  Eigen::MatrixXd design(values.size(), size);
  for (Eigen::Index i = 0; i < values.size(); ++i)
    design.row(i) = curve.value_row(time_s[i]).transpose();
  const double scale = std::max(std::sqrt(values.squaredNorm() / static_cast<double>(values.size())),
                                std::sqrt(covariance.diagonal().mean()));
  double best = -std::numeric_limits<double>::infinity();
  double best_size = scale;
  for (double smoothness = 1.0; smoothness <= smoothest; smoothness += 0.25) {
    const Eigen::VectorXd shape = prior_of(size, smoothness);
    for (double log_size = -3; log_size <= 3; log_size += 0.25) {
      const double size_here = scale * std::exp(log_size);
      const double evidence =
          regressed(design, values, covariance, size_here * size_here * shape, false).log_evidence;
      if (!(evidence > best)) continue;
      best = evidence;
      best_size = size_here;
      curve.smoothness = smoothness;
    }
  }
  const Regression chosen =
      regressed(design, values, covariance, best_size * best_size * prior_of(size, curve.smoothness), true);
  curve.coefficients = chosen.coefficients;
  curve.covariance = chosen.covariance;
  return curve;
}

PeriodicRegression closed(const PeriodicRegression& curve) {
  PeriodicRegression result = curve;
  const Eigen::VectorXd with_mean = curve.covariance.col(0);
  const double variance = with_mean[0];
  result.coefficients -= with_mean * (curve.coefficients[0] / variance);
  result.covariance -= with_mean * with_mean.transpose() / variance;
  return result;
}

}  // namespace diastole::imaging
