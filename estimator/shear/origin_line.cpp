#include "estimator/shear/origin_line.hpp"

#include <cmath>
#include <limits>

namespace diastole {

OriginLine line_through_origin(std::span<const double> x, std::span<const double> y) {
  OriginLine line = {};
  double sum_xy = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    line.sum_xx += x[i] * x[i];
    line.sum_yy += y[i] * y[i];
    sum_xy += x[i] * y[i];
  }
  line.slope = sum_xy / line.sum_xx;
  for (size_t i = 0; i < x.size(); ++i)
    line.sum_of_residuals2 += std::pow(y[i] - line.slope * x[i], 2);
  line.dof = static_cast<double>(x.size()) - 1;
  line.se = line.dof > 0 ? std::sqrt(line.sum_of_residuals2 / line.dof / line.sum_xx)
                         : std::numeric_limits<double>::quiet_NaN();
  return line;
}

double intercept_deviations(std::span<const double> x, std::span<const double> y) {
  const double n = static_cast<double>(x.size());
  double mean_x = 0, mean_y = 0, sum_xx = 0, sum_xy = 0, residuals2 = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  for (size_t i = 0; i < x.size(); ++i) {
    sum_xx += (x[i] - mean_x) * (x[i] - mean_x);
    sum_xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (n < 3 || sum_xx <= 0) return std::numeric_limits<double>::quiet_NaN();
  const double slope = sum_xy / sum_xx;
  const double intercept = mean_y - slope * mean_x;
  for (size_t i = 0; i < x.size(); ++i)
    residuals2 += std::pow(y[i] - intercept - slope * x[i], 2);
  return intercept / std::sqrt(residuals2 / (n - 2) * (1 / n + mean_x * mean_x / sum_xx));
}

}  // namespace diastole
