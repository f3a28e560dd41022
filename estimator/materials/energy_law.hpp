#pragma once
// Makes a Law of a struct that states its energy once:
//
//   struct NeoHookean {
//     static constexpr std::string_view name = "neo-hookean";
//     static constexpr bool needs_axes = false;
//     static constexpr std::array<LawParameter, 1> parameters{...};
//     template <class Scalar>
//     static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 1>& values);
//     // optional fast path; used when present, and tested against the dual numbers:
//     static MaterialResponse response(const SymmetricTensor<double>& c, std::span<const double> values);
//     static SymmetricTensor<double> stress(const SymmetricTensor<double>& c, std::span<const double>
//     values); static SymmetricTensor<double> stress_sensitivity(c, values, size_t parameter);
//   };
//
// Derivatives come from ceres::Jet, nested once for the tangent. With w(c0..c5) the energy over the six
// stored components and f = 2 for a diagonal, 1 for an off-diagonal one: S_m = f_m dw/dc_m, D_mn = f_m f_n
// d2w/dc_m dc_n.

#include <ceres/jet.h>
#include <array>
#include <cmath>
#include <concepts>

#include "estimator/materials/law.hpp"

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

/// r(q; b) = (exp(b q) - 1) / b: the exponential stiffening that most tissue laws share. It starts as r = q
/// with slope one whatever b is, and is q itself at b = 0, so that b = 0 gives the linear law back.
///
/// Near b q = 0 the quotient is summed as its power series, of which the first neglected term changes neither
/// the value nor the first two derivatives by more than 1e-13 of them.
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

template <class Energy>
class EnergyLaw final : public Law {
  static constexpr size_t count = Energy::parameters.size();
  using Tensor = SymmetricTensor<double>;
  using Values = std::span<const double>;

 public:
  std::string_view name() const override { return Energy::name; }
  bool needs_axes() const override { return Energy::needs_axes; }
  std::span<const LawParameter> parameters() const override { return Energy::parameters; }

  double energy(const Tensor& c, Values values) const override {
    return Energy::template energy<double>(c, constants<double>(values));
  }

  Tensor stress(const Tensor& c, Values values) const override {
    if constexpr (requires {
                    { Energy::stress(c, values) } -> std::same_as<Tensor>;
                  }) {
      return Energy::stress(c, values);
    } else {
      return dual_stress(c, values);
    }
  }

  MaterialResponse response(const Tensor& c, Values values) const override {
    if constexpr (requires {
                    { Energy::response(c, values) } -> std::same_as<MaterialResponse>;
                  }) {
      return Energy::response(c, values);
    } else {
      return dual_response(c, values);
    }
  }

  Tensor stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    if constexpr (requires {
                    { Energy::stress_sensitivity(c, values, parameter) } -> std::same_as<Tensor>;
                  }) {
      return Energy::stress_sensitivity(c, values, parameter);
    } else {
      return dual_stress_sensitivity(c, values, parameter);
    }
  }

  MaterialResponse dual_response(const Tensor& c, Values values) const override {
    using Inner = ceres::Jet<double, 6>;
    using Outer = ceres::Jet<Inner, 6>;
    SymmetricTensor<Outer> dual;
    for (size_t m = 0; m < 6; ++m) {
      dual[m] = constant<Outer>(0.0);
      dual[m].a = Inner(c[m], static_cast<int>(m));
      dual[m].v[static_cast<Eigen::Index>(m)] = Inner(1.0);
    }
    std::array<Outer, count> parameter_values = constants<Outer>(values);
    const Outer w = Energy::template energy<Outer>(dual, parameter_values);
    MaterialResponse result;
    for (size_t m = 0; m < 6; ++m) {
      const Inner& slope = w.v[static_cast<Eigen::Index>(m)];
      result.stress[m] = weight(m) * slope.a;
      for (size_t n = 0; n < 6; ++n) {
        result.tangent(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(n)) =
            weight(m) * weight(n) * slope.v[static_cast<Eigen::Index>(n)];
      }
    }
    return result;
  }

  Tensor dual_stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    using Inner = ceres::Jet<double, 1>;
    using Outer = ceres::Jet<Inner, 6>;
    SymmetricTensor<Outer> dual;
    for (size_t m = 0; m < 6; ++m) {
      dual[m] = constant<Outer>(c[m]);
      dual[m].v[static_cast<Eigen::Index>(m)] = Inner(1.0);
    }
    std::array<Outer, count> parameter_values = constants<Outer>(values);
    parameter_values[parameter].a.v[0] = 1.0;
    const Outer w = Energy::template energy<Outer>(dual, parameter_values);
    Tensor result;
    for (size_t m = 0; m < 6; ++m)
      result[m] = weight(m) * w.v[static_cast<Eigen::Index>(m)].v[0];
    return result;
  }

 private:
  template <class Scalar>
  static std::array<Scalar, count> constants(Values values) {
    std::array<Scalar, count> result;
    for (size_t i = 0; i < count; ++i)
      result[i] = constant<Scalar>(values[i]);
    return result;
  }
  static constexpr double weight(size_t m) { return m < 3 ? 2.0 : 1.0; }

  static Tensor dual_stress(const Tensor& c, Values values) {
    using Dual = ceres::Jet<double, 6>;
    SymmetricTensor<Dual> dual;
    for (size_t m = 0; m < 6; ++m)
      dual[m] = Dual(c[m], static_cast<int>(m));
    const std::array<Dual, count> parameter_values = constants<Dual>(values);
    const Dual w = Energy::template energy<Dual>(dual, parameter_values);
    Tensor result;
    for (size_t m = 0; m < 6; ++m)
      result[m] = weight(m) * w.v[static_cast<Eigen::Index>(m)];
    return result;
  }
};

/// The one law of an energy.
template <class Energy>
const Law& law_of() {
  static const EnergyLaw<Energy> law;
  return law;
}

}  // namespace diastole
