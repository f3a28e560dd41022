#pragma once
// What a formula may do with numbers. The order of `Operation` is that of no file: programs are made when a file is read.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "estimator/expressions/dual_number.hpp"

namespace diastole::expressions {

enum class Operation : uint8_t {
  number,
  input,
  add,
  subtract,
  multiply,
  divide,
  negate,
  power,  ///< a^b, a > 0 unless both are numbers
  root,
  exponential,
  exponential_minus_one,
  logarithm,
  logarithm_plus_one,
  sine,
  cosine,
  hyperbolic_tangent,
  arctangent,
  magnitude,
  sign,
  minimum,
  maximum,
  normal,   ///< the normal distribution: a smooth step from 0 to 1
  less,     ///< 1 if a < b, else 0
  at_most,  ///< 1 if a <= b, else 0
  select    ///< b if a is not 0, else c
};

constexpr size_t operands_of(Operation operation) {
  using enum Operation;
  switch (operation) {
    case number:
    case input:
      return 0;
    case add:
    case subtract:
    case multiply:
    case divide:
    case power:
    case minimum:
    case maximum:
    case less:
    case at_most:
      return 2;
    case select:
      return 3;
    default:
      return 1;
  }
}

/// The operation on numbers or dual numbers; `b` and `c` only where it has them.
template <class Scalar>
inline Scalar carried_out(Operation operation, const Scalar& a, const Scalar& b, const Scalar& c) {
  using std::abs, std::atan, std::cos, std::erfc, std::exp, std::expm1, std::log, std::log1p, std::sin,
      std::sqrt, std::tanh;
  using enum Operation;
  switch (operation) {
    case add:
      return a + b;
    case subtract:
      return a - b;
    case multiply:
      return a * b;
    case divide:
      return a / b;
    case negate:
      return -a;
    case power:
      if constexpr (std::is_same_v<Scalar, double>) {
        return std::pow(a, b);
      } else {
        return exp(b * log(a));
      }
    case root:
      return sqrt(a);
    case exponential:
      return exp(a);
    case exponential_minus_one:
      return expm1(a);
    case logarithm:
      return log(a);
    case logarithm_plus_one:
      return log1p(a);
    case sine:
      return sin(a);
    case cosine:
      return cos(a);
    case hyperbolic_tangent:
      return tanh(a);
    case arctangent:
      return atan(a);
    case magnitude:
      return plain_value(a) < 0.0 ? -a : a;
    case sign: {
      const double value = plain_value(a);
      return constant<Scalar>(value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0);
    }
    case minimum:
      return plain_value(b) < plain_value(a) ? b : a;
    case maximum:
      return plain_value(a) < plain_value(b) ? b : a;
    case normal:
      return constant<Scalar>(0.5) * erfc(constant<Scalar>(-std::numbers::sqrt2 / 2.0) * a);
    case less:
      return constant<Scalar>(plain_value(a) < plain_value(b) ? 1.0 : 0.0);
    case at_most:
      return constant<Scalar>(plain_value(a) <= plain_value(b) ? 1.0 : 0.0);
    case select:
      return plain_value(a) != 0.0 ? b : c;
    case number:
    case input:
      break;
  }
  return a;
}

}  // namespace diastole::expressions
