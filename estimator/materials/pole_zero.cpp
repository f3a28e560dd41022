// Orthotropic pole-zero law of laminar myocardium: each strain component has its own limit, the pole,
//
//   W = sum over ij = ff, ss, nn, fs, sn, nf of  k_ij E_ij^2 / (a_ij - |E_ij|)^b_ij,    E = (C - I)/2
//
// where |E_ij| < a_ij. In compression (E_ff, E_ss or E_nn < 0) the pole is absent and the term is
// k E^2 / a^b, which has the same stress and stiffness at rest: without any term there the law leaves the
// ratio of the two lateral strains in a uniaxial test undetermined. Beyond a pole the energy is not a number,
// which the solver takes as a step too far.
//
// P. J. Hunter, M. P. Nash, G. P. Sands, in: Computational Biology of the Heart, Wiley 1997, 345-407; M. P.
// Nash, P. J. Hunter, "Computational mechanics of the heart", J. Elasticity 61 (2000) 113-141. Typical
// values: E. W. Remme, M. P. Nash, P. J. Hunter, in: Cardiac Mechano-Electric Feedback and Arrhythmias,
// Elsevier 2005, chapter 41.

#include <array>
#include <cmath>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct PoleZero {
  static constexpr std::string_view name = "pole-zero";
  static constexpr bool needs_axes = true;
  // One row for each strain component, in the order of law.hpp.
  static constexpr std::array<LawParameter, 18> parameters{
      {{"kff_kPa", "fibre stiffness", 0.0, 2.0, "kPa"},
       {"aff", "fibre strain limit", 0.0, 0.475},
       {"bff", "curvature towards it", 0.0, 1.5},
       {"kss_kPa", "sheet stiffness", 0.0, 2.0, "kPa"},
       {"ass", "sheet strain limit", 0.0, 0.619},
       {"bss", "curvature towards it", 0.0, 1.5},
       {"knn_kPa", "sheet-normal stiffness", 0.0, 2.0, "kPa"},
       {"ann", "sheet-normal strain limit", 0.0, 0.943},
       {"bnn", "curvature towards it", 0.0, 0.442},
       {"kfs_kPa", "fibre-sheet shear stiffness", 0.0, 1.0, "kPa"},
       {"afs", "fibre-sheet shear strain limit", 0.0, 0.8},
       {"bfs", "curvature towards it", 0.0, 1.2},
       {"ksn_kPa", "sheet-normal shear stiffness", 0.0, 1.0, "kPa"},
       {"asn", "sheet-normal shear strain limit", 0.0, 0.8},
       {"bsn", "curvature towards it", 0.0, 1.2},
       {"kfn_kPa", "fibre-normal shear stiffness", 0.0, 1.0, "kPa"},
       {"afn", "fibre-normal shear strain limit", 0.0, 0.8},
       {"bfn", "curvature towards it", 0.0, 1.2}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 18>& values) {
    using std::exp;
    using std::log;
    Scalar w = constant<Scalar>(0.0);
    for (size_t m = 0; m < 6; ++m) {
      const Scalar strain = constant<Scalar>(0.5) * (m < 3 ? c[m] - constant<Scalar>(1.0) : c[m]);
      const Scalar& limit = values[3 * m + 1];
      Scalar gap = limit;
      if (plain_value(strain) > 0.0) gap = limit - strain;
      if (plain_value(strain) < 0.0 && m >= 3) gap = limit + strain;
      w += values[3 * m] * strain * strain * exp(-values[3 * m + 2] * log(gap));
    }
    return w;
  }
};

}  // namespace

const Law& pole_zero_law() { return law_of<PoleZero>(); }

}  // namespace diastole
