// Transversely isotropic Fung exponential, the paper's Eq. 5, in fibre f, cross-fibre s, radial r = n:
//
//   W = C/2 (exp Q - 1),   Q = b1 Eff^2 + b2 (Err^2 + Ess^2 + 2 Esr^2) + 2 b3 (Efs^2 + Efr^2),   E = (C -
//   I)/2
//
// J. M. Guccione, A. D. McCulloch, L. K. Waldman, "Passive material properties of intact ventricular
// myocardium determined from a cylindrical model", J. Biomech. Eng. 113 (1991) 42-55. The convention of S.
// Land et al., Proc. R. Soc. A 471 (2015) 20150641, is the same law: bf = b1, bt = b2, bfs = b3.
//
// With k the constant that multiplies each tensor component (b1 ff, b2 ss nn sn, b3 fs nf), Q is the sum of
// k_m E_m^2 over the nine entries, and S_m = C e^Q k_m E_m.

#include <array>
#include <cmath>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

using Tensor = SymmetricTensor<double>;

/// E, k and the products that stress and tangent share, at one strain.
struct FungState {
  Tensor strain;
  Tensor constant;  ///< k
  Tensor pull;      ///< k_m E_m = half of dQ/dE_m
  double rise;      ///< e^Q

  FungState(const Tensor& c, std::span<const double> values)
      : constant{values[1], values[2], values[2], values[3], values[2], values[3]} {
    double q = 0.0;
    for (size_t m = 0; m < 6; ++m) {
      strain[m] = 0.5 * (m < 3 ? c[m] - 1.0 : c[m]);
      pull[m] = constant[m] * strain[m];
      q += (m < 3 ? 1.0 : 2.0) * pull[m] * strain[m];
    }
    rise = std::exp(q);
  }
};

struct Guccione {
  static constexpr std::string_view name = "guccione";
  static constexpr bool needs_axes = true;
  static constexpr std::array<LawParameter, 4> parameters{
      {{"C_kPa", "stress scale: W = C/2 (exp Q - 1)", 0.0, 1.2, "kPa"},
       {"b1", "stiffness along the fibre (Land's bf)", 0.0, 26.7},
       {"b2", "stiffness across the fibre (Land's bt)", 0.0, 2.0},
       {"b3", "stiffness in shear along the fibre (Land's bfs)", 0.0, 14.7}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 4>& values) {
    using std::exp;
    const Scalar half = constant<Scalar>(0.5);
    const Scalar two = constant<Scalar>(2.0);
    const Scalar one = constant<Scalar>(1.0);
    const auto& [c_kPa, b1, b2, b3] = values;
    const Scalar ff = half * (c[0] - one);
    const Scalar ss = half * (c[1] - one);
    const Scalar nn = half * (c[2] - one);
    const Scalar fs = half * c[3];
    const Scalar sn = half * c[4];
    const Scalar nf = half * c[5];
    const Scalar q = b1 * ff * ff + b2 * (ss * ss + nn * nn + two * sn * sn) + two * b3 * (fs * fs + nf * nf);
    return half * c_kPa * (exp(q) - one);
  }

  static Tensor stress(const Tensor& c, std::span<const double> values) {
    const FungState at(c, values);
    Tensor result;
    for (size_t m = 0; m < 6; ++m)
      result[m] = values[0] * at.rise * at.pull[m];
    return result;
  }

  static MaterialResponse response(const Tensor& c, std::span<const double> values) {
    const FungState at(c, values);
    const double scale_kPa = values[0] * at.rise;
    MaterialResponse result;
    for (size_t m = 0; m < 6; ++m) {
      result.stress[m] = scale_kPa * at.pull[m];
      for (size_t n = 0; n < 6; ++n) {
        result.tangent(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(n)) =
            2.0 * scale_kPa * at.pull[m] * at.pull[n];
      }
      result.tangent(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(m)) +=
          scale_kPa * at.constant[m] * (m < 3 ? 1.0 : 0.5);
    }
    return result;
  }

  static Tensor stress_sensitivity(const Tensor& c, std::span<const double> values, size_t parameter) {
    const FungState at(c, values);
    constexpr std::array<size_t, 6> parameter_of_entry{1, 2, 2, 3, 2, 3};
    double rise_slope = 0.0;  // of Q with respect to the parameter
    for (size_t m = 0; m < 6; ++m) {
      if (parameter_of_entry[m] == parameter) rise_slope += (m < 3 ? 1.0 : 2.0) * at.strain[m] * at.strain[m];
    }
    Tensor result;
    for (size_t m = 0; m < 6; ++m) {
      const double own = parameter_of_entry[m] == parameter ? at.strain[m] : 0.0;
      result[m] = at.rise * (parameter == 0 ? at.pull[m] : values[0] * (rise_slope * at.pull[m] + own));
    }
    return result;
  }
};

}  // namespace

const Law& guccione_law() { return law_of<Guccione>(); }

}  // namespace diastole
