// A law that none is: W = C1 (I1 - 3) + C2 (I1 - 3)^2.

#include <array>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct Dummy {
  static constexpr std::string_view name = "dummy";
  static constexpr bool needs_axes = false;
  static constexpr std::array<LawParameter, 2> parameters{
      {{"C1_kPa", "half the shear modulus at rest", 0.0, 5.0, "kPa"},
       {"C2_kPa", "stiffening", 0.0, 1.0, "kPa"}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 2>& values) {
    const Scalar strain = trace(c) - constant<Scalar>(3.0);
    return strain * (values[0] + values[1] * strain);
  }
};

}  // namespace

const Law& dummy_law() { return law_of<Dummy>(); }

}  // namespace diastole
