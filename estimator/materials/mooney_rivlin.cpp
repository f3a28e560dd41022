// Mooney-Rivlin rubber: W = C1 (I1 - 3) + C2 (I2 - 3), I2 = (I1^2 - tr C^2) / 2; shear modulus 2 (C1 + C2).
//
// M. Mooney, "A theory of large elastic deformation", J. Appl. Phys. 11 (1940) 582-592; R. S. Rivlin, D. W.
// Saunders, Phil. Trans. R. Soc. A 243 (1951) 251-288, whose vulcanised rubber (about 1.7 and 0.2 kg/cm^2)
// gives the typical values.

#include <array>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct MooneyRivlin {
  static constexpr std::string_view name = "mooney-rivlin";
  static constexpr bool needs_axes = false;
  static constexpr std::array<LawParameter, 2> parameters{
      {{"C1_kPa", "multiplies I1 - 3", 0.0, 170.0, "kPa"},
       {"C2_kPa", "multiplies I2 - 3", 0.0, 20.0, "kPa"}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 2>& values) {
    const Scalar three = constant<Scalar>(3.0);
    const Scalar second = c[0] * c[1] + c[1] * c[2] + c[2] * c[0] - c[3] * c[3] - c[4] * c[4] - c[5] * c[5];
    return values[0] * (trace(c) - three) + values[1] * (second - three);
  }
};

}  // namespace

const Law& mooney_rivlin_law() { return law_of<MooneyRivlin>(); }

}  // namespace diastole
