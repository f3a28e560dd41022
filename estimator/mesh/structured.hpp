#pragma once
// Elements of an i1 x i2 x i3 grid: numbering and faces that all structured meshes share.
//
// Node number = i1 + m1 (i2 + (n2 + 1) i3), with m1 = n1 nodes around if xi1 closes on itself and n1 + 1 if
// not; element number = i1 + n1 (i2 + n2 i3). Faces: left/right are the ends of xi1 (none if it closes),
// bottom/top those of xi2, inner/outer those of xi3.

#include <array>
#include <cstddef>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct ElementGrid {
  std::array<size_t, 3> elements;
  bool closes = true;  ///< xi1 runs around

  [[nodiscard]] size_t nodes_around() const { return elements[0] + (closes ? 0 : 1); }
  [[nodiscard]] size_t node_count() const { return nodes_around() * (elements[1] + 1) * (elements[2] + 1); }
  [[nodiscard]] size_t node(size_t i1, size_t i2, size_t i3) const {
    return i1 % nodes_around() + nodes_around() * (i2 + (elements[1] + 1) * i3);
  }
};

std::vector<HermiteMesh::Corners> grid_elements(const ElementGrid& grid);
MeshFaces grid_faces(const ElementGrid& grid);

}  // namespace diastole
