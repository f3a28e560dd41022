#pragma once
// A plane cut through the undeformed body, as cells small enough to be drawn in one colour each.
//
// Every element is divided into small bricks in xi; the plane cuts a brick in a polygon of three to six
// corners, found on the brick's edges. Cells keep material points, so that they can be drawn in any
// deformed state. A plane that only touches a face of elements cuts those on its negative side.

#include <Eigen/Dense>
#include <array>
#include <functional>
#include <vector>

#include "estimator/io/solution_file.hpp"
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

// A straight line through the wall of the undeformed body, from the inner to the outer face.

struct WallProfile {
  std::vector<double> depth_mm;  ///< from the inner face, undeformed
  std::vector<MaterialPoint> points;
};

/// The first wall that a ray meets: `count` >= 2 points, faces included. Empty if it meets none.
WallProfile cross_wall(const HermiteMesh& mesh, const Eigen::Vector3d& from_mm,
                       const Eigen::Vector3d& direction, size_t count);

// The two sections that reports show of a body before and after a motion: across the axis z at a height, and along it.

/// Both go through `centre_mm` on the axis, whose height `height_words` says. `fields_at` gives what the cells show at
/// their centres: of each field as many values as points.
std::vector<SolutionSection> drawn_sections(
    const HermiteMesh& mesh, const NodeField& position_mm, const Eigen::Vector3d& centre_mm,
    const std::string& height_words,
    const std::function<std::vector<NamedField>(const std::vector<MaterialPoint>&)>& fields_at);

}  // namespace diastole
