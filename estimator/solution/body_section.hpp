#pragma once
// A plane cut through the undeformed body, as cells small enough to be drawn in one colour each.
//
// Every element is divided into small bricks in xi; the plane cuts a brick in a polygon of three to six
// corners, found on the brick's edges. Cells keep material points, so that they can be drawn in any
// deformed state. A plane that only touches a face of elements cuts those on its negative side.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// Through `origin_mm`, spanned by two orthogonal unit vectors.
struct SectionPlane {
  Eigen::Vector3d origin_mm;
  Eigen::Vector3d horizontal;
  Eigen::Vector3d vertical;
};

struct SectionCell {
  size_t element = 0;
  std::vector<Xi> corners;  ///< around the polygon
  [[nodiscard]] MaterialPoint centre() const;
};

using MaterialLine = std::array<MaterialPoint, 2>;

struct BodySection {
  std::vector<SectionCell> cells;
  std::vector<MaterialLine> outline;   ///< where the plane cuts the body's surface
  std::vector<MaterialLine> elements;  ///< where it cuts faces between elements
};

/// `cell_mm` is the size that cells have at most, about; in a coarse mesh there are at least six across an element.
BodySection cut_body(const HermiteMesh& mesh, const SectionPlane& plane, double cell_mm);

}  // namespace diastole
