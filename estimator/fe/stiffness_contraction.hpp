#pragma once
// The element's displacement stiffness by sum factorisation: the 192x192 matrix
//
//   K(ai, bk) = sum over q, K, L of  dN_a/dxi_K(q)  A(q; iK, kL)  dN_b/dxi_L(q)
//
// is contracted one direction at a time (N_a is a product of three cubic functions), which costs some 0.8
// million multiplications an element instead of 14 million: first over q1, then q2, then q3.
// The derivative index K matters only as "is it this direction?", so that terms merge on the way.
//
// A(q; iK, kL) = d(P_iK)/d(g_kL) with g = dx/dxi and P the first Piola-Kirchhoff stress per unit of xi,
// weights included; it must be symmetric in (iK) <-> (kL). Units: kPa mm.

#include <array>
#include <cstddef>
#include <vector>

#include "estimator/fe/gauss_points.hpp"

namespace diastole {

/// Index of the 81 moduli at a point: [K][L][i][k].
constexpr size_t modulus_index(size_t i, size_t direction_k, size_t k, size_t direction_l) {
  return ((direction_k * 3 + direction_l) * 3 + i) * 3 + k;
}
inline constexpr size_t moduli = 81;

class StiffnessContraction {
 public:
  StiffnessContraction();

  /// The moduli to fill, all of them, before `contract`: moduli_at(q)[modulus_index(...)].
  double* moduli_at(size_t q) { return &moduli_[q * moduli]; }

  void contract();

  /// K(ai, bk) after `contract`. Precondition: a / 16 <= b / 16 (the other half follows by symmetry).
  [[nodiscard]] double entry(size_t a, size_t i, size_t b, size_t k) const {
    return stiffness_[(((pair_row(a >> 4, b >> 4) * 4 + ((a >> 2) & 3)) * 4 + ((b >> 2) & 3)) * 9 + i * 3 +
                       k) *
                          16 +
                      (a & 3) * 4 + (b & 3)];
  }

 private:
  /// Rows of the pairs a3 <= b3: 00 01 02 03 11 12 13 22 23 33.
  static constexpr size_t pair_row(size_t a3, size_t b3) { return a3 * (7 - a3) / 2 + b3; }

  void contract_first(size_t q3);
  void contract_second(size_t q3);
  void contract_third();

  // Products h_a h_b of one direction: pairs_[derivative of a][derivative of b][q][4 a + b].
  std::array<std::array<std::array<std::array<double, 16>, line_points>, 2>, 2> pairs_;
  std::vector<double> moduli_;     // [q][81]
  std::vector<double> first_;      // [q2][KL][ik][a1 b1] of one q3
  std::vector<double> second_;     // [q3][is K 3][is L 3][a2 b2][ik][a1 b1]
  std::vector<double> stiffness_;  // [a3 <= b3][a2 b2][ik][a1 b1]
};

}  // namespace diastole
