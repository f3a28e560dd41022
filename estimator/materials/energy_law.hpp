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
// Derivatives come from dual numbers (dual_response.hpp).

#include <array>
#include <cmath>
#include <concepts>

#include "estimator/materials/dual_response.hpp"
#include "estimator/materials/law.hpp"

namespace diastole {

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
      return dual_stress_of(of_duals, c, constants_of(values));
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
    return dual_response_of(of_duals, c, constants_of(values));
  }

  Tensor dual_stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    return dual_stress_sensitivity_of(of_duals, c, constants_of(values), parameter);
  }

 private:
  static constexpr auto of_duals = []<class Scalar>(const SymmetricTensor<Scalar>& c,
                                                    const std::array<Scalar, count>& values) {
    return Energy::template energy<Scalar>(c, values);
  };
  static auto constants_of(Values values) {
    return [values]<class Scalar>() { return constants<Scalar>(values); };
  }
  template <class Scalar>
  static std::array<Scalar, count> constants(Values values) {
    std::array<Scalar, count> result;
    for (size_t i = 0; i < count; ++i)
      result[i] = constant<Scalar>(values[i]);
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
