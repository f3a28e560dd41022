#include "estimator/inference/parameter.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::inference {

double to_coordinate(Scale scale, double value) {
  if (scale == Scale::logarithmic) return std::log(value);
  if (scale == Scale::inverse_square) return 1e4 / (value * value);
  return value;
}

double from_coordinate(Scale scale, double coordinate) {
  if (scale == Scale::logarithmic) return std::exp(coordinate);
  if (scale == Scale::inverse_square) return 1e2 / std::sqrt(coordinate);
  return coordinate;
}

double value_slope(Scale scale, double coordinate) {
  if (scale == Scale::logarithmic) return std::exp(coordinate);
  if (scale == Scale::inverse_square) return -0.5e2 / (coordinate * std::sqrt(coordinate));
  return 1.0;
}

std::array<double, 2> Parameter::coordinate_bounds() const {
  const double a = coordinate(lower), b = coordinate(upper);
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace diastole::inference
