// Ogden rubber in principal stretches: W = sum over i = 1..3 of  mu_i/alpha_i (l1^alpha_i + l2^alpha_i +
// l3^alpha_i - 3); the shear modulus at rest is half the sum of mu_i alpha_i.
//
// R. W. Ogden, "Large deformation isotropic elasticity: on the correlation of theory and experiment for
// incompressible rubberlike solids", Proc. R. Soc. A 326 (1972) 565-584, whose fit of Treloar's rubber gives
// the typical values. A term is switched off by mu = 0.
//
// Derivatives where principal stretches coalesce. Turn C into the axes Q of its plain value, in which it is
// diag(x) + H with H a pure infinitesimal. Second-order perturbation theory of f(x) = x^(alpha/2),
//
//   tr f(C) = sum_i f(x_i + H_ii) + sum_{i<j} H_ij^2 f'[x_i, x_j] + O(H^3),
//
// is exact for the first and second derivatives that dual numbers carry, and needs eigenvectors of the plain
// value alone. The divided difference f'[x, y] = (f'(x) - f'(y)) / (x - y) of a power is an expm1 quotient,
// smooth through x = y, so that equal stretches (always at rest) are no special case.

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

/// (x^k - y^k) / (x - y) for x, y > 0; k y^(k-1) at x = y.
double power_difference(double x, double y, double k) {
  const double ratio_log = std::log1p((x - y) / y);
  const double quotient = ratio_log == 0.0 ? k : std::expm1(k * ratio_log) / std::expm1(ratio_log);
  return std::pow(y, k - 1.0) * quotient;
}

template <class Scalar>
SymmetricTensor<Scalar> turned(const SymmetricTensor<Scalar>& c, const Eigen::Matrix3d& axes) {
  SymmetricTensor<Scalar> result;
  for (size_t m = 0; m < 6; ++m) {
    const auto column = [&](size_t which) { return axes.col(static_cast<Eigen::Index>(which)); };
    const auto first = column(symmetric_entries[m][0]);
    const auto second = column(symmetric_entries[m][1]);
    result[m] = constant<Scalar>(0.0);
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        const size_t entry = symmetric_index[static_cast<size_t>(i)][static_cast<size_t>(j)];
        result[m] += constant<Scalar>(first[i] * second[j]) * c[entry];
      }
    }
  }
  return result;
}

struct Ogden {
  static constexpr std::string_view name = "ogden";
  static constexpr bool needs_axes = false;
  static constexpr double any = -1e300;
  static constexpr std::array<LawParameter, 6> parameters{
      {{"mu1_kPa", "first modulus", any, 630.0, "kPa"},
       {"alpha1", "its exponent; mu1 alpha1 > 0 is stable", any, 1.3},
       {"mu2_kPa", "second modulus", any, 1.2, "kPa"},
       {"alpha2", "its exponent", any, 5.0},
       {"mu3_kPa", "third modulus", any, -10.0, "kPa"},
       {"alpha3", "its exponent", any, -2.0}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 6>& values) {
    using std::exp;
    using std::log;
    SymmetricTensor<double> plain;
    for (size_t m = 0; m < 6; ++m)
      plain[m] = plain_value(c[m]);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spectrum(full_matrix(plain));
    const Eigen::Vector3d& x = spectrum.eigenvalues();
    const SymmetricTensor<Scalar> principal = turned(c, spectrum.eigenvectors());
    Scalar w = constant<Scalar>(0.0);
    for (size_t term = 0; term < 3; ++term) {
      const Scalar& alpha = values[2 * term + 1];
      const double half = 0.5 * plain_value(alpha);
      Scalar sum = constant<Scalar>(-3.0);
      for (size_t i = 0; i < 3; ++i)
        sum += exp(constant<Scalar>(0.5) * alpha * log(principal[i]));
      for (size_t m = 3; m < 6; ++m) {
        const double bend =
            half * power_difference(x[static_cast<Eigen::Index>(symmetric_entries[m][0])],
                                    x[static_cast<Eigen::Index>(symmetric_entries[m][1])], half - 1.0);
        sum += constant<Scalar>(bend) * principal[m] * principal[m];
      }
      w += values[2 * term] / alpha * sum;
    }
    return w;
  }
};

}  // namespace

const Law& ogden_law() { return law_of<Ogden>(); }

}  // namespace diastole
