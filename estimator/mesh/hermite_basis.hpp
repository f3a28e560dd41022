#pragma once
// Cubic Hermite functions on 0 <= xi <= 1 and their tensor product on the unit cube.
//
// One direction has four functions, numbered a = 2*end + derivative (end 0 at xi = 0, end 1 at xi = 1;
// derivative 0 carries the value, 1 the slope d/dxi):
//
//   h0 = 1 - 3 xi^2 + 2 xi^3     value at xi = 0        h2 = 3 xi^2 - 2 xi^3   value at xi = 1
//   h1 = xi (1 - xi)^2           slope at xi = 0        h3 = xi^2 (xi - 1)     slope at xi = 1
//
// The cube has 64 functions N_a = h_a1(xi1) h_a2(xi2) h_a3(xi3), a = a1 + 4 a2 + 16 a3. `hermite_corner(a)`
// and `hermite_derivative(a)` say which corner and which nodal derivative a function belongs to (drawn in
// estimator/mesh/hermite_mesh.hpp). The functions are polynomials, so xi may lie outside the unit cube.

#include <array>
#include <cstddef>

namespace diastole {

using Xi = std::array<double, 3>;

inline constexpr size_t hermite_functions = 64;
inline constexpr size_t corners = 8;
inline constexpr size_t nodal_derivatives = 8;

/// h_0..h_3 at xi.
constexpr std::array<double, 4> hermite_values(double xi) {
  const double rest = 1.0 - xi;
  return {rest * rest * (1.0 + 2.0 * xi), xi * rest * rest, xi * xi * (3.0 - 2.0 * xi), -xi * xi * rest};
}

/// dh_0/dxi .. dh_3/dxi at xi.
constexpr std::array<double, 4> hermite_slopes(double xi) {
  return {6.0 * xi * (xi - 1.0), (1.0 - xi) * (1.0 - 3.0 * xi), 6.0 * xi * (1.0 - xi), xi * (3.0 * xi - 2.0)};
}

/// d2h_0/dxi2 .. d2h_3/dxi2 at xi.
constexpr std::array<double, 4> hermite_curvatures(double xi) {
  return {12.0 * xi - 6.0, 6.0 * xi - 4.0, 6.0 - 12.0 * xi, 6.0 * xi - 2.0};
}

/// Corner b1 + 2 b2 + 4 b3 of function a, b = 0 or 1 along each xi.
constexpr size_t hermite_corner(size_t a) { return ((a >> 1) & 1) | ((a >> 2) & 2) | ((a >> 3) & 4); }

/// Nodal derivative d1 + 2 d2 + 4 d3 of function a: d_k = 1 means differentiated along xi_k.
constexpr size_t hermite_derivative(size_t a) { return (a & 1) | ((a >> 1) & 2) | ((a >> 2) & 4); }

/// The function that belongs to a corner and a nodal derivative: inverse of the two above.
constexpr size_t hermite_function(size_t corner, size_t derivative) {
  size_t a = 0;
  for (size_t k = 0; k < 3; ++k)
    a |= ((((corner >> k) & 1) << 1) | ((derivative >> k) & 1)) << (2 * k);
  return a;
}

/// Values and the three first derivatives of the 64 functions at one place.
struct HermiteBasis {
  std::array<double, hermite_functions> value;
  std::array<std::array<double, hermite_functions>, 3> slope;  ///< slope[k][a] = dN_a/dxi_k
};

HermiteBasis hermite_basis(const Xi& xi);

/// The eight tri-linear functions at the corners b1 + 2 b2 + 4 b3.
std::array<double, corners> trilinear_basis(const Xi& xi);

}  // namespace diastole
