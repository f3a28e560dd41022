// Incompressible neo-Hookean solid, the paper's silicon gel: W = C1 (I1 - 3), I1 = tr C.
// The shear modulus is 2 C1. S = 2 C1 I, constant, so that the tangent dS/dE vanishes.

#include <array>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct NeoHookean {
  static constexpr std::string_view name = "neo-hookean";
  static constexpr bool needs_axes = false;
  static constexpr std::array<LawParameter, 1> parameters{
      {{"C1_kPa", "half the shear modulus: W = C1 (I1 - 3)", 0.0, 8.71, "kPa"}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 1>& values) {
    return values[0] * (trace(c) - constant<Scalar>(3.0));
  }

  static SymmetricTensor<double> stress(const SymmetricTensor<double>&, std::span<const double> values) {
    const double s = 2.0 * values[0];
    return {s, s, s, 0.0, 0.0, 0.0};
  }

  static MaterialResponse response(const SymmetricTensor<double>& c, std::span<const double> values) {
    return {stress(c, values), TangentTensor::Zero()};
  }

  static SymmetricTensor<double> stress_sensitivity(const SymmetricTensor<double>&, std::span<const double>,
                                                    size_t) {
    return {2.0, 2.0, 2.0, 0.0, 0.0, 0.0};
  }
};

}  // namespace

const Law& neo_hookean_law() { return law_of<NeoHookean>(); }

}  // namespace diastole
