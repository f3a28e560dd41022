#pragma once
// r(q; b) = (exp(b q) - 1) / b: the exponential stiffening that most tissue laws share. It starts as r = q
// with slope one whatever b is, and is q itself at b = 0, so that b = 0 gives the linear law back.
//
// Near b q = 0 the quotient is summed as its power series, of which the first neglected term changes neither
// the value nor the first two derivatives by more than 1e-13 of them.

#include <cmath>

#include "estimator/materials/energy_law.hpp"

namespace diastole {

template <class Scalar>
Scalar exponential_rise(const Scalar& q, const Scalar& b) {
  using std::exp;
  constexpr double series_below = 1e-3;
  const Scalar x = b * q;
  if (std::abs(plain_value(x)) > series_below) return (exp(x) - constant<Scalar>(1.0)) / b;
  Scalar series = constant<Scalar>(1.0);
  for (const double order : {6.0, 5.0, 4.0, 3.0, 2.0})
    series = constant<Scalar>(1.0) + x * series * constant<Scalar>(1.0 / order);
  return q * series;
}

}  // namespace diastole
