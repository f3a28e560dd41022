#pragma once
// A number with its mixed derivatives by three variables, and what a smooth map makes of a Hermite mesh: the nodes
// take the map's values and exact xi derivatives, by the chain rule through the mesh's own geometry.

#include <array>
#include <cmath>
#include <cstddef>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// part[d1 + 2 d2 + 4 d3] is differentiated d_k = 0 or 1 times by variable k: what a node of the mesh holds.
struct Mixed {
  std::array<double, 8> part{};

  static Mixed variable(double value, size_t which) {
    Mixed x;
    x.part[0] = value;
    x.part[size_t{1} << which] = 1.0;
    return x;
  }
};

inline Mixed operator+(Mixed a, const Mixed& b) {
  for (size_t m = 0; m < 8; ++m)
    a.part[m] += b.part[m];
  return a;
}

inline Mixed operator*(double factor, Mixed a) {
  for (double& part : a.part)
    part *= factor;
  return a;
}

inline Mixed operator*(const Mixed& a, const Mixed& b) {
  Mixed product;
  for (size_t m = 0; m < 8; ++m) {
    for (size_t n = 0; n < 8; ++n) {
      if ((m & n) == 0) product.part[m | n] += a.part[m] * b.part[n];
    }
  }
  return product;
}

/// f(a) from f and its first three derivatives at the plain value; higher ones need a variable twice.
inline Mixed composed(const Mixed& a, const std::array<double, 4>& f) {
  Mixed rest = a;
  rest.part[0] = 0.0;
  const Mixed square = rest * rest;
  Mixed result = f[1] * rest + (f[2] / 2.0) * square + (f[3] / 6.0) * (square * rest);
  result.part[0] = f[0];
  return result;
}

inline Mixed sin(const Mixed& a) {
  const double s = std::sin(a.part[0]);
  const double c = std::cos(a.part[0]);
  return composed(a, {s, c, -s, -c});
}

/// Nodes of the deformed body, x = map({X, Y, Z}). Precondition: the mesh has no scale factors and ties.
template <class Map>
NodeField mapped(const HermiteMesh& mesh, const Map& map) {
  NodeField field(mesh.reference().size());
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    std::array<Mixed, 3> reference;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t d = 0; d < nodal_derivatives; ++d)
        reference[i].part[d] = mesh.reference()[dof_of(node, d, i)];
    }
    const std::array<Mixed, 3> x = map(reference);
    for (size_t i = 0; i < 3; ++i) {
      for (size_t d = 0; d < nodal_derivatives; ++d)
        field[dof_of(node, d, i)] = x[i].part[d];
    }
  }
  return field;
}

}  // namespace diastole
