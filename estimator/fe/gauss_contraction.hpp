#pragma once
// Sums over an element's 64 functions at its 64 Gauss points, one direction at a time (N_a is a product of three cubic
// functions): 6,000 multiplications instead of 37,000.

#include <Eigen/Dense>
#include <array>

#include "estimator/fe/gauss_points.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// A 3x3 matrix at each Gauss point, its columns belonging to xi1, xi2, xi3.
class GaussMatrices {
 public:
  [[nodiscard]] Eigen::Matrix3d at(size_t q) const {
    Eigen::Matrix3d matrix;
    for (size_t k = 0; k < 3; ++k) {
      for (size_t i = 0; i < 3; ++i)
        matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = numbers[k][3 * q + i];
    }
    return matrix;
  }
  void set(size_t q, const Eigen::Matrix3d& matrix) {
    for (size_t k = 0; k < 3; ++k) {
      for (size_t i = 0; i < 3; ++i)
        numbers[k][3 * q + i] = matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
    }
  }

  std::array<std::array<double, 3 * gauss_points>, 3> numbers;  ///< [column][point][row]
};

/// dx/dxi: at(q)(i, k) = sum over a of x(i, a) dN_a/dxi_k(q).
GaussMatrices gradients_at_points(const ElementField& field);

/// force(i, a) = sum over q and k of p.at(q)(i, k) dN_a/dxi_k(q): the transpose of gradients_at_points().
ElementField force_of(const GaussMatrices& p);

}  // namespace diastole
