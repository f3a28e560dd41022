#pragma once
// Residuals about a point, r(q + s) = r + J s, and what a least-squares search expects from them.

#include <Eigen/Core>
#include <vector>

#include "estimator/inference/parameter_space.hpp"

namespace diastole::inference {

struct LinearModel {
  Eigen::VectorXd q;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  /// Length of the steps, in standard errors, over which the Jacobian was kept since it was last computed.
  double kept_over_sigmas = 0.0;

  [[nodiscard]] double chi_square() const { return residuals.squaredNorm(); }
  /// By how much chi-square falls in a step.
  [[nodiscard]] double expected_gain(const Eigen::VectorXd& step) const;
  /// By how much it falls in the best step of the unknowns that are not held.
  [[nodiscard]] double greatest_gain(const std::vector<bool>& held) const;
  /// Moves to another point and keeps the Jacobian by C. G. Broyden's update in the metric of the columns' sizes: the
  /// least change that explains what the step did.
  void move_to(const Eigen::VectorXd& to, const Eigen::VectorXd& residuals_there);
};

/// Moves to the least chi-square that the linear model has within the bounds. Unknowns that are not free stay; those that a bound stops are
/// held on it. Precondition: q is within the bounds, and `is_free` has an entry for each unknown.
void move_to_minimum(LinearModel& model, const ParameterSpace& space, std::vector<bool> is_free);

/// The unknowns that rest on a bound while chi-square falls only beyond it.
std::vector<bool> pressed_on_bounds(const LinearModel& model, const ParameterSpace& space);

}  // namespace diastole::inference
