#pragma once
// A straight line through the origin, y = slope * x, by least squares.

#include <span>

namespace diastole {

struct OriginLine {
  double slope;
  double se;      ///< NaN for a single point
  double sum_xx;  ///< sum of x^2
  double sum_yy;  ///< sum of y^2
  double sum_of_residuals2;
  double dof;  ///< points - 1
};

/// At least one x is not zero; x and y are of one length.
OriginLine line_through_origin(std::span<const double> x, std::span<const double> y);

/// The intercept of the straight line with a free intercept over its standard error: Student's t with n - 2
/// degrees of freedom if the true line passes through the origin. NaN if all x are equal or n < 3.
double intercept_deviations(std::span<const double> x, std::span<const double> y);

}  // namespace diastole
