#pragma once
// Every law's energy typed a second time, in long double and by another route than the law's own where there is one, and
// differentiated numerically: what closed-form tests compare the laws with. A law without its energy here fails its
// tests with a message that says so.
//
// C is given in the law's material axes (estimator/materials/law.hpp).

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace diastole {

using Real = long double;
using RealMatrix = Eigen::Matrix<Real, 3, 3>;
using TypedEnergy = Real (*)(const RealMatrix& c, const std::vector<Real>& k);

namespace typed {

inline Real neo_hookean(const RealMatrix& c, const std::vector<Real>& k) { return k[0] * (c.trace() - 3); }

inline Real guccione(const RealMatrix& c, const std::vector<Real>& k) {
  const RealMatrix e = (c - RealMatrix::Identity()) / 2;
  const Real q = k[1] * e(0, 0) * e(0, 0) +
                 k[2] * (e(1, 1) * e(1, 1) + e(2, 2) * e(2, 2) + e(1, 2) * e(1, 2) + e(2, 1) * e(2, 1)) +
                 k[3] * (e(0, 1) * e(0, 1) + e(1, 0) * e(1, 0) + e(0, 2) * e(0, 2) + e(2, 0) * e(2, 0));
  return k[0] / 2 * std::expm1(q);
}

/// I2 as the trace of the cofactors.
inline Real mooney_rivlin(const RealMatrix& c, const std::vector<Real>& k) {
  return k[0] * (c.trace() - 3) + k[1] * (c.determinant() * c.inverse().trace() - 3);
}

/// In principal stretches themselves.
inline Real ogden(const RealMatrix& c, const std::vector<Real>& k) {
  const Eigen::SelfAdjointEigenSolver<RealMatrix> spectrum(c, Eigen::EigenvaluesOnly);
  Real w = 0;
  for (size_t term = 0; term < 3; ++term) {
    for (Eigen::Index i = 0; i < 3; ++i)
      w += k[2 * term] / k[2 * term + 1] *
           (std::pow(std::sqrt(spectrum.eigenvalues()[i]), k[2 * term + 1]) - 1);
  }
  return w;
}

inline Real demiray(const RealMatrix& c, const std::vector<Real>& k) {
  return k[0] / k[1] * std::expm1(k[1] * (c.trace() - 3));
}

/// By the invariants I1, I4f, I4s and I8fs.
inline Real holzapfel_ogden(const RealMatrix& c, const std::vector<Real>& k) {
  const auto pulled = [](Real i4) { return i4 > 1 ? (i4 - 1) * (i4 - 1) : Real(0); };
  return k[0] / (2 * k[1]) * std::expm1(k[1] * (c.trace() - 3)) +
         k[2] / (2 * k[3]) * std::expm1(k[3] * pulled(c(0, 0))) +
         k[4] / (2 * k[5]) * std::expm1(k[5] * pulled(c(1, 1))) +
         k[6] / (2 * k[7]) * std::expm1(k[7] * c(0, 1) * c(0, 1));
}

/// Six poles in the order ff, ss, nn, fs, sn, fn; none in compression.
inline Real pole_zero(const RealMatrix& c, const std::vector<Real>& k) {
  const RealMatrix e = (c - RealMatrix::Identity()) / 2;
  const std::array<Real, 6> strain{e(0, 0), e(1, 1), e(2, 2), e(0, 1), e(1, 2), e(0, 2)};
  Real w = 0;
  for (size_t m = 0; m < 6; ++m) {
    const Real towards_the_pole = m < 3 ? std::max(strain[m], Real(0)) : std::abs(strain[m]);
    w += k[3 * m] * strain[m] * strain[m] / std::pow(k[3 * m + 1] - towards_the_pole, k[3 * m + 2]);
  }
  return w;
}

/// Matrix and one family of fibres, which bear compression too.
inline Real fibre_reinforced(const RealMatrix& c, const std::vector<Real>& k) {
  return k[0] / k[1] * std::expm1(k[1] * (c.trace() - 3)) +
         k[2] / (2 * k[3]) * std::expm1(k[3] * (c(0, 0) - 1) * (c(0, 0) - 1));
}

/// By Criscione's kinematics: C = R^T R with R upper triangular, the fibre first. R11 is the fibre stretch, (R12, R13)
/// / R11 the sliding along it, and the singular values of the rest, in the ratio exp(2 beta3), the cross-fibre shear.
inline Real strain_attribute(const RealMatrix& c, const std::vector<Real>& k) {
  const RealMatrix r = Eigen::LLT<RealMatrix>(c).matrixU();
  const Real attribute2 = std::log(r(0, 0));
  const Real sum = r(1, 1) * r(1, 1) + r(1, 2) * r(1, 2) + r(2, 2) * r(2, 2);
  const Real product = r(1, 1) * r(2, 2);
  const Real sinh_square3 = (sum / product - 2) / 4;
  const Real slide_square = (r(0, 1) * r(0, 1) + r(0, 2) * r(0, 2)) / (r(0, 0) * r(0, 0));
  return k[0] / (2 * k[1]) * std::expm1(k[1] * attribute2 * attribute2) +
         k[2] / (2 * k[3]) * std::expm1(k[3] * sinh_square3) +
         k[4] / (2 * k[5]) * std::expm1(k[5] * slide_square);
}

}  // namespace typed

inline TypedEnergy typed_energy(std::string_view law) {
  static const std::vector<std::pair<std::string_view, TypedEnergy>> all{
      {"neo-hookean", typed::neo_hookean},
      {"guccione", typed::guccione},
      {"mooney-rivlin", typed::mooney_rivlin},
      {"ogden", typed::ogden},
      {"demiray", typed::demiray},
      {"holzapfel-ogden", typed::holzapfel_ogden},
      {"pole-zero", typed::pole_zero},
      {"fibre-reinforced", typed::fibre_reinforced},
      {"strain-attribute", typed::strain_attribute}};
  for (const auto& [name, energy] : all) {
    if (name == law) return energy;
  }
  throw std::logic_error("type the energy of " + std::string(law) +
                         " in tests/estimator/materials/typed_energies.hpp");
}

/// f'(x) by central differences of sixth order.
inline Real numerical_slope(const std::function<Real(Real)>& f, Real x, Real h = 1e-4L) {
  return (45 * (f(x + h) - f(x - h)) - 9 * (f(x + 2 * h) - f(x - 2 * h)) + f(x + 3 * h) - f(x - 3 * h)) /
         (60 * h);
}

}  // namespace diastole
