#pragma once
// A plane cut through a body, undeformed or deformed, as cells small enough to be drawn in one colour each.
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

/// Of the body with its nodes at `position_mm`. `cell_mm` is the size that cells have at most, about; in a coarse mesh there
/// are at least six across an element.
BodySection cut_body(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane,
                     double cell_mm);

/// The lines on which a function of the material is zero, straight in each cell.
std::vector<MaterialLine> level_lines(const BodySection& section,
                                      const std::function<double(const MaterialPoint&)>& function);

// A straight line through the wall of the undeformed body, from the inner to the outer face.

struct WallProfile {
  std::vector<double> depth_mm;  ///< from the inner face, undeformed
  std::vector<MaterialPoint> points;
};

/// The first wall that a ray meets: `count` >= 2 points, faces included. Empty if it meets none.
WallProfile cross_wall(const HermiteMesh& mesh, const Eigen::Vector3d& from_mm,
                       const Eigen::Vector3d& direction, size_t count);

// The two sections that reports show of a body before and after a motion: across the axis z at a height, and along it.

/// On the axis, half-way up the cavity's wall; of a body without one, half-way up the body.
Eigen::Vector3d middle_of(const HermiteMesh& mesh);

/// "z = 3 mm"
std::string height_words(const Eigen::Vector3d& place_mm);

/// Both go through the middle. `fields_at` gives what the cells show at their centres: of each field as many values as points.
std::vector<SolutionSection> drawn_sections(
    const HermiteMesh& mesh, const NodeField& position_mm,
    const std::function<std::vector<NamedField>(const std::vector<MaterialPoint>&)>& fields_at);

}  // namespace diastole
