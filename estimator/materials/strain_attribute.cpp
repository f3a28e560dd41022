// Transversely isotropic tissue by strain attributes instead of invariants: numbers that each measure one
// mode of deformation, so that the stress terms of different modes do not overlap and their constants are
// less correlated in a fit. With the fibre f first and the fibre stretch l = sqrt(Cff):
//
//   fibre stretch         q2 = (ln l)^2
//   cross-fibre shear     q3 = sinh^2(beta3), beta3 the logarithmic pure shear within the plane across the
//                         fibre: sinh^2(beta3) = (tr B / sqrt(det B) - 2) / 4, B the Schur complement
//                         C_ij - C_if C_jf / Cff of that plane
//   shear along the fibre q4 = (Cfs^2 + Cfn^2) / Cff^2, the square of the sliding of that plane along f
//
//   W = 1/2 sum over i = 2, 3, 4 of  k_i / m_i (exp(m_i q_i) - 1)
//
// The attributes are the beta2, beta3, beta4 (here as smooth even functions) of J. C. Criscione, A. S.
// Douglas, W. C. Hunter, "Physically based strain invariant set for materials exhibiting transversely
// isotropic behavior", J. Mech. Phys. Solids 49 (2001) 871-897, carried to myocardium by J. C. Criscione, A.
// D. McCulloch, W. C. Hunter, "Constitutive framework optimized for myocardium and other high-strain, laminar
// materials with one fiber family", J. Mech. Phys. Solids 50 (2002) 1681-1702. beta1 = ln J is zero here; the
// coupling beta5 of the shear directions is left out. The exponential energy is this project's choice.
// Typical values: equal in modulus at rest and in growth to the guccione law at its typical values.

#include <array>
#include <cmath>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct StrainAttribute {
  static constexpr std::string_view name = "strain-attribute";
  static constexpr bool needs_axes = true;
  static constexpr std::array<LawParameter, 6> parameters{
      {{"k2_kPa", "Young's modulus along the fibre at rest", 0.0, 33.2, "kPa"},
       {"m2", "stiffening with fibre stretch", 0.0, 27.7},
       {"k3_kPa", "four times the shear modulus across the fibre", 0.0, 4.8, "kPa"},
       {"m3", "stiffening with cross-fibre shear", 0.0, 4.0},
       {"k4_kPa", "shear modulus along the fibre", 0.0, 8.8, "kPa"},
       {"m4", "stiffening with shear along the fibre", 0.0, 7.4}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 6>& values) {
    using std::log;
    using std::sqrt;
    const auto& [k2, m2, k3, m3, k4, m4] = values;
    const Scalar stretch_log = constant<Scalar>(0.5) * log(c[0]);
    const Scalar ss = c[1] - c[3] * c[3] / c[0];
    const Scalar nn = c[2] - c[5] * c[5] / c[0];
    const Scalar sn = c[4] - c[3] * c[5] / c[0];
    const Scalar q3 = constant<Scalar>(0.25) * ((ss + nn) / sqrt(ss * nn - sn * sn) - constant<Scalar>(2.0));
    const Scalar q4 = (c[3] * c[3] + c[5] * c[5]) / (c[0] * c[0]);
    return constant<Scalar>(0.5) *
           (k2 * exponential_rise<Scalar>(stretch_log * stretch_log, m2) +
            k3 * exponential_rise<Scalar>(q3, m3) + k4 * exponential_rise<Scalar>(q4, m4));
  }
};

}  // namespace

const Law& strain_attribute_law() { return law_of<StrainAttribute>(); }

}  // namespace diastole
