#pragma once
// What code that is written once for numbers and for dual numbers (ceres::Jet, nested for second derivatives) needs.

#include <ceres/jet.h>

namespace diastole {

/// A number inside an energy: constant<Scalar>(3.0). (Nested dual numbers do not mix with double.)
template <class Scalar>
struct ConstantOf {
  static Scalar make(double value) { return Scalar(value); }
};
template <class Inner, int Count>
struct ConstantOf<ceres::Jet<Inner, Count>> {
  static ceres::Jet<Inner, Count> make(double value) {
    ceres::Jet<Inner, Count> dual;
    dual.a = ConstantOf<Inner>::make(value);
    dual.v.setConstant(ConstantOf<Inner>::make(0.0));
    return dual;
  }
};
template <class Scalar>
Scalar constant(double value) {
  return ConstantOf<Scalar>::make(value);
}

/// What a dual number stands at: for branches, and for factors that derivatives up to the second do not need.
constexpr double plain_value(double value) { return value; }
template <class Inner, int Count>
double plain_value(const ceres::Jet<Inner, Count>& dual) {
  return plain_value(dual.a);
}

}  // namespace diastole
