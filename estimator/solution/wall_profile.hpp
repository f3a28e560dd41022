#pragma once
// A straight line through the wall of the undeformed body, from the inner to the outer face.

#include <Eigen/Dense>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct WallProfile {
  std::vector<double> depth_mm;  ///< from the inner face, undeformed
  std::vector<MaterialPoint> points;
};

/// The first wall that a ray meets: `count` >= 2 points, faces included. Empty if it meets none.
WallProfile cross_wall(const HermiteMesh& mesh, const Eigen::Vector3d& from_mm,
                       const Eigen::Vector3d& direction, size_t count);

}  // namespace diastole
