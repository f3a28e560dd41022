#include "estimator/inference/intervals.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace diastole::inference {

double standard_error(const Parameter& parameter, double coordinate, double sd) {
  return std::abs(parameter.slope(coordinate)) * sd;
}

std::array<double, 2> interval(const Parameter& parameter, double coordinate, double half_width) {
  const double a = parameter.value(coordinate - half_width), b = parameter.value(coordinate + half_width);
  return {std::min(a, b), std::max(a, b)};
}

double student_quantile(double dof, double two_sided) {
  return boost::math::quantile(boost::math::complement(boost::math::students_t(dof), two_sided / 2));
}

}  // namespace diastole::inference
