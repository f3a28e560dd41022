#include "estimator/mesh/wall_coordinates.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/mesh/nodal_lines.hpp"

namespace diastole {

WallCoordinates::WallCoordinates(const HermiteMesh& mesh) : depths_(NodalLines(mesh).depths()) {
  lowest_mm_ = mesh.reference()[dof_of(0, 0, 2)];
  double highest_mm = lowest_mm_;
  for (size_t node = 1; node < mesh.node_count(); ++node) {
    const double z_mm = mesh.reference()[dof_of(node, 0, 2)];
    lowest_mm_ = std::min(lowest_mm_, z_mm);
    highest_mm = std::max(highest_mm, z_mm);
  }
  height_mm_ = highest_mm - lowest_mm_;
}

WallPlace WallCoordinates::at(const HermiteMesh& mesh, const MaterialPoint& point) const {
  const Eigen::Vector3d X_mm = mesh.value(mesh.reference(), point);
  return {std::atan2(X_mm[1], X_mm[0]), 2.0 * (X_mm[2] - lowest_mm_) / height_mm_ - 1.0,
          between_nodes(mesh, depths_, point)};
}

}  // namespace diastole
