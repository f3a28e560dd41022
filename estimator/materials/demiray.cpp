// Exponentially stiffening isotropic tissue: W = C1/beta (exp(beta (I1 - 3)) - 1).
// The shear modulus at rest is 2 C1; beta = 0 is the neo-Hookean solid, a negative beta softens.
//
// H. Demiray, "A note on the elasticity of soft biological tissues", J. Biomech. 5 (1972) 309-311. Typical
// values: the isotropic part of myocardium in G. A. Holzapfel, R. W. Ogden, Phil. Trans. R. Soc. A 367 (2009)
// 3445-3475 (there a = 2 C1 = 0.33 kPa, b = beta = 9.242).

#include <array>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct Demiray {
  static constexpr std::string_view name = "demiray";
  static constexpr bool needs_axes = false;
  static constexpr std::array<LawParameter, 2> parameters{
      {{"C1_kPa", "half the shear modulus at rest", 0.0, 0.165, "kPa"},
       {"beta", "stiffening with I1 - 3; 0 is neo-Hookean", -1.0, 9.242}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 2>& values) {
    return values[0] * exponential_rise<Scalar>(trace(c) - constant<Scalar>(3.0), values[1]);
  }
};

}  // namespace

const Law& demiray_law() { return law_of<Demiray>(); }

}  // namespace diastole
