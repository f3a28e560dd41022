#pragma once
// Stress, tangent and their derivatives by a parameter of an energy that is written once for numbers and dual numbers:
// energy(c, values) with a SymmetricTensor and a sequence of values, all of one scalar type.
//
// Derivatives come from ceres::Jet, nested once for the tangent. With w(c0..c5) the energy over the six stored components
// and f = 2 for a diagonal, 1 for an off-diagonal one: S_m = f_m dw/dc_m, D_mn = f_m f_n d2w/dc_m dc_n.

#include <cstddef>

#include "estimator/expressions/dual_number.hpp"
#include "estimator/materials/law.hpp"

namespace diastole {

/// f_m.
constexpr double stress_weight(size_t m) { return m < 3 ? 2.0 : 1.0; }

/// `constants<Scalar>()` gives the values as constants of that type.
template <class Energy, class Constants>
MaterialResponse dual_response_of(const Energy& energy, const SymmetricTensor<double>& c,
                                  const Constants& constants) {
  using Inner = ceres::Jet<double, 6>;
  using Outer = ceres::Jet<Inner, 6>;
  SymmetricTensor<Outer> dual;
  for (size_t m = 0; m < 6; ++m) {
    dual[m] = constant<Outer>(0.0);
    dual[m].a = Inner(c[m], static_cast<int>(m));
    dual[m].v[static_cast<Eigen::Index>(m)] = Inner(1.0);
  }
  const auto values = constants.template operator()<Outer>();
  const Outer w = energy(dual, values);
  MaterialResponse result;
  for (size_t m = 0; m < 6; ++m) {
    const Inner& slope = w.v[static_cast<Eigen::Index>(m)];
    result.stress[m] = stress_weight(m) * slope.a;
    for (size_t n = 0; n < 6; ++n) {
      result.tangent(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(n)) =
          stress_weight(m) * stress_weight(n) * slope.v[static_cast<Eigen::Index>(n)];
    }
  }
  return result;
}

/// dS/d(values[parameter]).
template <class Energy, class Constants>
SymmetricTensor<double> dual_stress_sensitivity_of(const Energy& energy, const SymmetricTensor<double>& c,
                                                   const Constants& constants, size_t parameter) {
  using Inner = ceres::Jet<double, 1>;
  using Outer = ceres::Jet<Inner, 6>;
  SymmetricTensor<Outer> dual;
  for (size_t m = 0; m < 6; ++m) {
    dual[m] = constant<Outer>(c[m]);
    dual[m].v[static_cast<Eigen::Index>(m)] = Inner(1.0);
  }
  auto values = constants.template operator()<Outer>();
  values[parameter].a.v[0] = 1.0;
  const Outer w = energy(dual, values);
  SymmetricTensor<double> result;
  for (size_t m = 0; m < 6; ++m)
    result[m] = stress_weight(m) * w.v[static_cast<Eigen::Index>(m)].v[0];
  return result;
}

template <class Energy, class Constants>
SymmetricTensor<double> dual_stress_of(const Energy& energy, const SymmetricTensor<double>& c,
                                       const Constants& constants) {
  using Dual = ceres::Jet<double, 6>;
  SymmetricTensor<Dual> dual;
  for (size_t m = 0; m < 6; ++m)
    dual[m] = Dual(c[m], static_cast<int>(m));
  const auto values = constants.template operator()<Dual>();
  const Dual w = energy(dual, values);
  SymmetricTensor<double> result;
  for (size_t m = 0; m < 6; ++m)
    result[m] = stress_weight(m) * w.v[static_cast<Eigen::Index>(m)];
  return result;
}

}  // namespace diastole
