#include "estimator/imaging/tracking/motion_field.hpp"

#include <cmath>

namespace diastole::imaging {

double MotionField::value_mm(size_t phase, const Eigen::Vector2d& x_mm) const {
  return splines.value(coefficients.col(static_cast<Eigen::Index>(phase)), x_mm);
}

double MotionField::sigma_mm(const Eigen::MatrixXd& factor, const Eigen::Vector2d& x_mm) const {
  const SplineValues values = splines.at(x_mm);
  Eigen::Vector3d rest;
  rest << (x_mm - middle_mm) / extent_mm, 1.0;
  Eigen::VectorXd weighed = Eigen::VectorXd::Zero(factor.rows());
  for (size_t i = 0; i < 16; ++i) {
    if (values.index[i] >= 0) weighed += values.value(i) * factor.col(values.index[i]);
  }
  return std::sqrt(rest.dot(rest_covariance_mm2 * rest) + weighed.squaredNorm());
}

}  // namespace diastole::imaging
