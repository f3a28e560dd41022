#include "estimator/imaging/tracking/motion_field.hpp"

#include <cmath>

namespace diastole::imaging {

double MotionField::value_mm(size_t phase, const Eigen::Vector2d& x_mm) const {
  return splines.value(coefficients.col(static_cast<Eigen::Index>(phase)), x_mm);
}

Eigen::MatrixXd MotionField::phase_factor(size_t phase) const {
  const Eigen::Index count = splines.count();
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(inverse_factor.rows(), count);
  for (Eigen::Index m = 0; m < modes.cols(); ++m) {
    const Eigen::Index below = inverse_factor.rows() - m * count;
    factor.bottomRows(below) +=
        modes(static_cast<Eigen::Index>(phase), m) * inverse_factor.block(m * count, m * count, below, count);
  }
  return factor;
}

double MotionField::sigma_mm(size_t phase, const Eigen::MatrixXd& factor, const Eigen::Vector2d& x_mm) const {
  const SplineValues values = splines.at(x_mm);
  const auto time = static_cast<Eigen::Index>(phase);
  Eigen::Vector3d rest;
  rest << (x_mm - middle_mm) / extent_mm, 1.0;
  double variance = rest.dot(rest_covariance_mm2 * rest) + left_out_mm[time] * left_out_mm[time];
  Eigen::VectorXd weighed = Eigen::VectorXd::Zero(factor.rows());
  for (size_t i = 0; i < 16; ++i) {
    if (values.index[i] < 0) continue;
    const Eigen::Index below = factor.rows() - values.index[i];
    weighed.tail(below) += values.value(i) * factor.col(values.index[i]).tail(below);
  }
  variance += weighed.squaredNorm();
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace diastole::imaging
