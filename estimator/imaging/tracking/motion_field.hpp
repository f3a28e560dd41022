#pragma once
// The motion that one direction of tags shows in a slice: w(x, t) = n . X - n . x in mm, where the material at x came from X and n is the
// tags' normal. A tag that lay on the plane n . X = d is seen where n . x + w(x, t) = d.

#include <Eigen/Dense>

#include "estimator/imaging/tracking/joint_motion.hpp"

namespace diastole::imaging {

struct MotionField {
  SplinePlane splines;
  Eigen::MatrixXd coefficients;         ///< n x T
  JointCovariance covariance;           ///< of them
  Eigen::Matrix3d rest_covariance_mm2;  ///< of the tags at rest: of (x - middle) / extent, and of the offset
  Eigen::Vector2d middle_mm;
  double extent_mm;

  [[nodiscard]] double value_mm(size_t phase, const Eigen::Vector2d& x_mm) const;
  /// `factor`: the covariance's, of the same phase.
  [[nodiscard]] double sigma_mm(const Eigen::MatrixXd& factor, const Eigen::Vector2d& x_mm) const;
};

}  // namespace diastole::imaging
