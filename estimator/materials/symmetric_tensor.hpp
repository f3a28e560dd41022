#pragma once
// Symmetric 3x3 tensors by their six components, in material axes (f fibre, s sheet, n normal; for an
// isotropic law any orthonormal axes):
//
//   index   0   1   2   3   4   5
//   entry   ff  ss  nn  fs  sn  nf          an off-diagonal entry is stored once and is not doubled

#include <Eigen/Dense>
#include <array>
#include <cstddef>

namespace diastole {

template <class Scalar>
using SymmetricTensor = std::array<Scalar, 6>;

/// Material tangent dS/dE: entry (m, n) is the tensor component D_mn = 2 dS_m/dC_n, minor and major
/// symmetric.
using TangentTensor = Eigen::Matrix<double, 6, 6>;

inline constexpr std::array<std::array<size_t, 2>, 6> symmetric_entries{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};
/// symmetric_index[i][j]: where entry ij is stored.
inline constexpr std::array<std::array<size_t, 3>, 3> symmetric_index{{{0, 3, 5}, {3, 1, 4}, {5, 4, 2}}};

template <class Scalar>
Scalar trace(const SymmetricTensor<Scalar>& a) {
  return a[0] + a[1] + a[2];
}

template <class Scalar>
Scalar determinant(const SymmetricTensor<Scalar>& a) {
  return a[0] * (a[1] * a[2] - a[4] * a[4]) - a[3] * (a[3] * a[2] - a[4] * a[5]) +
         a[5] * (a[3] * a[4] - a[1] * a[5]);
}

inline Eigen::Matrix3d full_matrix(const SymmetricTensor<double>& a) {
  Eigen::Matrix3d full;
  full << a[0], a[3], a[5], a[3], a[1], a[4], a[5], a[4], a[2];
  return full;
}

/// Takes the upper triangle.
inline SymmetricTensor<double> symmetric_part(const Eigen::Matrix3d& a) {
  return {a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(1, 2), a(0, 2)};
}

}  // namespace diastole
