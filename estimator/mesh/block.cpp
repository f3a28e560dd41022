#include "estimator/mesh/block.hpp"

#include <utility>

#include "estimator/mesh/structured.hpp"

namespace diastole {

HermiteMesh make_block(const BlockShape& shape) {
  const ElementGrid grid{shape.elements, false};
  NodeField field(grid.node_count() * dofs_per_node, 0.0);
  for (size_t i3 = 0; i3 <= shape.elements[2]; ++i3) {
    for (size_t i2 = 0; i2 <= shape.elements[1]; ++i2) {
      for (size_t i1 = 0; i1 <= shape.elements[0]; ++i1) {
        const size_t node = grid.node(i1, i2, i3);
        const std::array<size_t, 3> place{i1, i2, i3};
        for (size_t k = 0; k < 3; ++k) {
          const double length_mm = shape.size_mm[k] / static_cast<double>(shape.elements[k]);
          field[dof_of(node, 0, k)] = length_mm * static_cast<double>(place[k]);
          field[dof_of(node, size_t{1} << k, k)] = length_mm;
        }
      }
    }
  }
  return HermiteMesh(std::move(field), grid_elements(grid), grid_faces(grid));
}

}  // namespace diastole
