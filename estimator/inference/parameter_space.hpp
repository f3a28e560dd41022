#pragma once
// A quantity that is to be estimated, and the coordinate in which it is searched: the one in which what is measured is
// nearest to linear in it.
//
//   scale            coordinate of a value v
//   linear           v
//   logarithmic      ln v             for a quantity that is known to a factor
//   inverse_square   (100 / v)^2      for a wave speed, whose inverse square is a compliance; falls as v rises
//
// A space is the unknowns of a search, in the order of their coordinates q.

#include <Eigen/Core>
#include <array>
#include <limits>
#include <string>
#include <vector>

namespace diastole::inference {

enum class Scale { linear, logarithmic, inverse_square };

/// Precondition: value > 0 unless the scale is linear.
double to_coordinate(Scale scale, double value);
double from_coordinate(Scale scale, double coordinate);

/// Invariant: lower <= upper, both in the domain of the scale; infinite where there is no bound.
struct Parameter {
  std::string name;
  std::string unit = {};
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  Scale scale = Scale::linear;

  [[nodiscard]] double coordinate(double value) const { return to_coordinate(scale, value); }
  [[nodiscard]] double value(double coordinate) const { return from_coordinate(scale, coordinate); }
  /// d(value)/d(coordinate).
  [[nodiscard]] double slope(double coordinate) const;
  /// The bounds' coordinates, the smaller one first.
  [[nodiscard]] std::array<double, 2> coordinate_bounds() const;
};

enum class BoundSide { none, lower, upper };

class ParameterSpace {
 public:
  ParameterSpace() = default;
  explicit ParameterSpace(std::vector<Parameter> parameters);

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  [[nodiscard]] const Parameter& operator[](Eigen::Index i) const {
    return parameters_[static_cast<size_t>(i)];
  }
  /// Bounds of the coordinates.
  [[nodiscard]] const Eigen::VectorXd& lower() const { return lower_; }
  [[nodiscard]] const Eigen::VectorXd& upper() const { return upper_; }
  [[nodiscard]] Eigen::VectorXd clamped(const Eigen::VectorXd& q) const;

  /// The coordinates of values, clamped. Precondition: a value for each parameter.
  [[nodiscard]] Eigen::VectorXd coordinates(const std::vector<double>& values) const;
  [[nodiscard]] std::vector<double> values(const Eigen::VectorXd& q) const;

  /// The bound of the coordinate on which an unknown rests, within 1e-7 of its range; none where it has no range.
  [[nodiscard]] BoundSide bound_under(const Eigen::VectorXd& q, Eigen::Index i) const;
  /// One entry an unknown: whether it rests on no bound.
  [[nodiscard]] std::vector<bool> free_unknowns(const Eigen::VectorXd& q) const;

 private:
  std::vector<Parameter> parameters_;
  Eigen::VectorXd lower_, upper_;
};

}  // namespace diastole::inference
