#include "estimator/imaging/tracking/motion_field.hpp"

#include <cmath>

namespace diastole::imaging {

double MotionField::value_mm(size_t phase, const Eigen::Vector2d& x_mm) const {
  return splines.value(coefficients.col(static_cast<Eigen::Index>(phase)), x_mm);
}

double MotionField::sigma_mm(size_t phase, const Eigen::Vector2d& x_mm) const {
  const SplineValues values = splines.at(x_mm);
  const auto time = static_cast<Eigen::Index>(phase);
  const Eigen::Index count = splines.count();
  Eigen::Vector3d rest;
  rest << (x_mm - middle_mm) / extent_mm, 1.0;
  double variance = rest.dot(rest_covariance_mm2 * rest) + left_out_mm[time] * left_out_mm[time];
  // v' C v = |F v|^2 with the lower triangle F and the few entries of v.
  Eigen::VectorXd weighed = Eigen::VectorXd::Zero(inverse_factor.rows());
  for (Eigen::Index m = 0; m < modes.cols(); ++m) {
    for (size_t i = 0; i < 16; ++i) {
      if (values.index[i] < 0) continue;
      const Eigen::Index at = m * count + values.index[i];
      const Eigen::Index below = weighed.size() - at;
      weighed.tail(below) += modes(time, m) * values.value[i] * inverse_factor.col(at).tail(below);
    }
  }
  variance += weighed.squaredNorm();
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace diastole::imaging
