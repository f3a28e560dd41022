#pragma once
// Where a point lies in a body around the z axis: the turn about it, the height between the lowest and the highest node, the depth from
// the inner wall to the outer one along xi3.

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct WallPlace {
  double turn_rad = 0.0;  ///< from x towards y, -pi to pi
  double height = 0.0;    ///< -1 to 1
  double depth = 0.0;     ///< 0 to 1
};

class WallCoordinates {
 public:
  explicit WallCoordinates(const HermiteMesh& mesh);

  /// Precondition: a mesh of the same topology.
  [[nodiscard]] WallPlace at(const HermiteMesh& mesh, const MaterialPoint& point) const;
  [[nodiscard]] double lowest_mm() const { return lowest_mm_; }
  [[nodiscard]] double height_mm() const { return height_mm_; }

 private:
  std::vector<double> depths_;  // of the nodes
  double lowest_mm_;
  double height_mm_;
};

}  // namespace diastole
