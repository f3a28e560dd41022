#include "estimator/inference/parameter_space.hpp"

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

double Parameter::slope(double coordinate) const {
  if (scale == Scale::logarithmic) return std::exp(coordinate);
  if (scale == Scale::inverse_square) return -0.5e2 / (coordinate * std::sqrt(coordinate));
  return 1.0;
}

std::array<double, 2> Parameter::coordinate_bounds() const {
  const double a = coordinate(lower), b = coordinate(upper);
  return {std::min(a, b), std::max(a, b)};
}

ParameterSpace::ParameterSpace(std::vector<Parameter> parameters)
    : parameters_(std::move(parameters)), lower_(size()), upper_(size()) {
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto [lower, upper] = (*this)[i].coordinate_bounds();
    lower_[i] = lower;
    upper_[i] = upper;
  }
}

Eigen::VectorXd ParameterSpace::clamped(const Eigen::VectorXd& q) const {
  return q.cwiseMax(lower_).cwiseMin(upper_);
}

Eigen::VectorXd ParameterSpace::coordinates(const std::vector<double>& values) const {
  Eigen::VectorXd q(size());
  for (Eigen::Index i = 0; i < size(); ++i)
    q[i] = (*this)[i].coordinate(values[static_cast<size_t>(i)]);
  return clamped(q);
}

std::vector<double> ParameterSpace::values(const Eigen::VectorXd& q) const {
  std::vector<double> result;
  for (Eigen::Index i = 0; i < size(); ++i)
    result.push_back((*this)[i].value(q[i]));
  return result;
}

BoundSide ParameterSpace::bound_under(const Eigen::VectorXd& q, Eigen::Index i) const {
  const double slack = 1e-7 * (upper_[i] - lower_[i]);
  if (!std::isfinite(slack)) return BoundSide::none;
  if (q[i] <= lower_[i] + slack) return BoundSide::lower;
  return q[i] >= upper_[i] - slack ? BoundSide::upper : BoundSide::none;
}

std::vector<bool> ParameterSpace::free_unknowns(const Eigen::VectorXd& q) const {
  std::vector<bool> is_free;
  for (Eigen::Index i = 0; i < size(); ++i)
    is_free.push_back(bound_under(q, i) == BoundSide::none);
  return is_free;
}

}  // namespace diastole::inference
