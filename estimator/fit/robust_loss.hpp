#pragma once
// A loss that wild points cannot pull far: minus twice the logarithm of Student's t instead of the normal's r^2,
//
//   rho(r) = (nu + 1) log(1 + r^2 / (nu s^2))        for a residual r in its stated standard deviations,
//
// for each residual of the motion; priors stay normal. nu = 4 loses a few per cent of precision on clean data (Lange,
// Little & Taylor, J. Am. Stat. Assoc. 84 (1989) 881). The scale s comes from the residuals' core, so that neither the
// stated sigma nor the wild points' number needs to be right.
//
// For least squares the residual is replaced by u = sign(r) sqrt(rho), exactly the same cost.

#include <Eigen/Dense>

namespace diastole {

struct RobustLoss {
  static constexpr double degrees = 4;  ///< nu
  double scale = 1;                     ///< s, in stated standard deviations

  /// With the scale of greatest likelihood for normal residuals of this standard deviation.
  static RobustLoss for_deviation(double deviation);

  /// u(r).
  [[nodiscard]] double residual(double r) const;
  /// du/dr.
  [[nodiscard]] double slope(double r) const;
  /// psi = rho'/2 and its derivative: what the errors of a robust estimate are made of.
  [[nodiscard]] double influence(double r) const;
  [[nodiscard]] double influence_slope(double r) const;
};

/// Standard deviation of the residuals' core: signal::deviation_of_normal of |r|.
double core_deviation(const Eigen::VectorXd& residuals);

/// How many residuals lie beyond five standard deviations, stated and of the core: chance makes one in two million.
Eigen::Index wild_count(const Eigen::VectorXd& residuals);

}  // namespace diastole
