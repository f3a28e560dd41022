// Orthotropic myocardium by its structure: matrix, fibres, sheets and their coupling,
//
//   W = a/(2b) (exp(b (I1 - 3)) - 1) + sum over i = f, s of  ai/(2bi) (exp(bi (I4i - 1)^2) - 1)  if I4i > 1
//       + afs/(2bfs) (exp(bfs I8fs^2) - 1),        I4f = Cff, I4s = Css, I8fs = Cfs
//
// Fibres and sheets bear no compression; stress is continuous where they slacken, the tangent jumps.
//
// G. A. Holzapfel, R. W. Ogden, "Constitutive modelling of passive myocardium: a structurally based framework
// for material characterization", Phil. Trans. R. Soc. A 367 (2009) 3445-3475, Eq. 5.38; typical values from
// its Table 1 (simple shear tests on pig myocardium by Dokos et al. 2002).

#include <array>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct HolzapfelOgden {
  static constexpr std::string_view name = "holzapfel-ogden";
  static constexpr bool needs_axes = true;
  static constexpr std::array<LawParameter, 8> parameters{
      {{"a_kPa", "matrix", 0.0, 0.059, "kPa"},
       {"b", "stiffening of the matrix", 0.0, 8.023},
       {"af_kPa", "fibres", 0.0, 18.472, "kPa"},
       {"bf", "stiffening of the fibres", 0.0, 16.026},
       {"as_kPa", "sheets", 0.0, 2.481, "kPa"},
       {"bs", "stiffening of the sheets", 0.0, 11.120},
       {"afs_kPa", "coupling in shear", 0.0, 0.216, "kPa"},
       {"bfs", "stiffening of it", 0.0, 11.436}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 8>& values) {
    const auto& [a, b, af, bf, as, bs, afs, bfs] = values;
    const Scalar half = constant<Scalar>(0.5);
    const Scalar one = constant<Scalar>(1.0);
    Scalar w = a * exponential_rise<Scalar>(trace(c) - constant<Scalar>(3.0), b);
    if (plain_value(c[0]) > 1.0) w += af * exponential_rise<Scalar>((c[0] - one) * (c[0] - one), bf);
    if (plain_value(c[1]) > 1.0) w += as * exponential_rise<Scalar>((c[1] - one) * (c[1] - one), bs);
    w += afs * exponential_rise<Scalar>(c[3] * c[3], bfs);
    return half * w;
  }
};

}  // namespace

const Law& holzapfel_ogden_law() { return law_of<HolzapfelOgden>(); }

}  // namespace diastole
