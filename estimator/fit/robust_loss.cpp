#include "estimator/fit/robust_loss.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/signal/median.hpp"

namespace diastole {
namespace {

constexpr double least_deviation = 1e-3;    // exact data have none
constexpr double scale_of_normal = 0.8310;  // of t with 4 degrees of freedom, fitted to the unit normal
constexpr double wild_deviations = 5.0;

}  // namespace

RobustLoss RobustLoss::for_deviation(double deviation) {
  return {scale_of_normal * std::max(deviation, least_deviation)};
}

double RobustLoss::residual(double r) const {
  const double rho = (degrees + 1) * std::log1p(r * r / (degrees * scale * scale));
  return std::copysign(std::sqrt(rho), r);
}

double RobustLoss::slope(double r) const {
  const double u = residual(r);
  if (u == 0) return std::sqrt((degrees + 1) / degrees) / scale;
  return influence(r) / u;
}

double RobustLoss::influence(double r) const { return (degrees + 1) * r / (degrees * scale * scale + r * r); }

double RobustLoss::influence_slope(double r) const {
  const double core = degrees * scale * scale;
  return (degrees + 1) * (core - r * r) / ((core + r * r) * (core + r * r));
}

double core_deviation(const Eigen::VectorXd& residuals) {
  if (residuals.size() == 0) return 0;
  std::vector<double> size(static_cast<size_t>(residuals.size()));
  std::transform(residuals.begin(), residuals.end(), size.begin(), [](double r) { return std::abs(r); });
  return signal::deviation_of_normal(std::move(size));
}

Eigen::Index wild_count(const Eigen::VectorXd& residuals) {
  const double limit = wild_deviations * std::max(1.0, core_deviation(residuals));
  return (residuals.array().abs() > limit).count();
}

}  // namespace diastole
