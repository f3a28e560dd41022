#include "estimator/mesh/structured.hpp"

namespace diastole {

std::vector<HermiteMesh::Corners> grid_elements(const ElementGrid& grid) {
  const auto [n1, n2, n3] = grid.elements;
  std::vector<HermiteMesh::Corners> elements;
  for (size_t i3 = 0; i3 < n3; ++i3) {
    for (size_t i2 = 0; i2 < n2; ++i2) {
      for (size_t i1 = 0; i1 < n1; ++i1) {
        HermiteMesh::Corners nodes;
        for (size_t c = 0; c < corners; ++c)
          nodes[c] = grid.node(i1 + (c & 1), i2 + ((c >> 1) & 1), i3 + ((c >> 2) & 1));
        elements.push_back(nodes);
      }
    }
  }
  return elements;
}

MeshFaces grid_faces(const ElementGrid& grid) {
  const auto [n1, n2, n3] = grid.elements;
  MeshFaces faces;
  for (size_t e = 0; e < n1 * n2 * n3; ++e) {
    const size_t i1 = e % n1;
    const size_t i2 = e / n1 % n2;
    const size_t i3 = e / (n1 * n2);
    if (!grid.closes && i1 == 0) faces.left.push_back({e, 0, 0});
    if (!grid.closes && i1 + 1 == n1) faces.right.push_back({e, 0, 1});
    if (i2 == 0) faces.bottom.push_back({e, 1, 0});
    if (i2 + 1 == n2) faces.top.push_back({e, 1, 1});
    if (i3 == 0) faces.inner.push_back({e, 2, 0});
    if (i3 + 1 == n3) faces.outer.push_back({e, 2, 1});
  }
  return faces;
}

}  // namespace diastole
