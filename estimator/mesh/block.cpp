#include "estimator/mesh/block.hpp"

#include <cmath>
#include <numbers>
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
          const double count = static_cast<double>(shape.elements[k]);
          const double g = k == 0 ? shape.left_grading : 0.0;
          const double s = static_cast<double>(place[k]) / count;
          const double angle = 0.5 * std::numbers::pi * s;
          field[dof_of(node, 0, k)] = shape.size_mm[k] * ((1.0 - g) * s + g * (1.0 - std::cos(angle)));
          field[dof_of(node, size_t{1} << k, k)] =
              shape.size_mm[k] / count * ((1.0 - g) + g * 0.5 * std::numbers::pi * std::sin(angle));
        }
      }
    }
  }
  return HermiteMesh(std::move(field), grid_elements(grid), grid_faces(grid));
}

}  // namespace diastole
