#pragma once
// A quantity that is to be estimated, and the coordinate in which it is searched: the one in which what is measured is
// nearest to linear in it.
//
//   scale            coordinate of a value v
//   linear           v
//   logarithmic      ln v             for a quantity that is known to a factor
//   inverse_square   (100 / v)^2      for a wave speed, whose inverse square is a compliance; falls as v rises

#include <array>
#include <limits>
#include <string>

namespace diastole::inference {

enum class Scale { linear, logarithmic, inverse_square };

/// Precondition: value > 0 unless the scale is linear.
double to_coordinate(Scale scale, double value);
double from_coordinate(Scale scale, double coordinate);
/// d(value)/d(coordinate).
double value_slope(Scale scale, double coordinate);

/// Invariant: lower <= upper, both in the domain of the scale; infinite where there is no bound.
struct Parameter {
  std::string name;
  std::string unit = {};
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  Scale scale = Scale::linear;

  [[nodiscard]] double coordinate(double value) const { return to_coordinate(scale, value); }
  [[nodiscard]] double value(double coordinate) const { return from_coordinate(scale, coordinate); }
  [[nodiscard]] double slope(double coordinate) const { return value_slope(scale, coordinate); }
  /// The bounds' coordinates, the smaller one first.
  [[nodiscard]] std::array<double, 2> coordinate_bounds() const;
};

}  // namespace diastole::inference
