#pragma once
// A mesh of tri-cubic Hermite hexahedra: geometry and every other C1 vector field over the same nodes.
//
//   element axes and corners (corner = b1 + 2 b2 + 4 b3)      nodal derivatives (derivative = d1 + 2 d2 + 4
//   d3)
//
//              6-----------7                                   0  value        4  d/dxi3
//     xi3     /|          /|                                   1  d/dxi1       5  d2/dxi1 dxi3
//      |     4-----------5 |                                   2  d/dxi2       6  d2/dxi2 dxi3
//      |  xi2| |         | |                                   3  d2/dxi1dxi2  7  d3/dxi1 dxi2 dxi3
//      | /   | 2---------|-3
//      |/    |/          |/                                    for the annulus: xi1 circumferential, xi2 up
//      +-xi1 0-----------1                                     (along z), xi3 from the inner to the outer
//      face
//
// A field (NodeField) holds 24 numbers a node: field[dof_of(node, derivative, component)], component x, y, z.
// An element's own derivative is the node's times a scale factor, so that neighbours of unequal size can
// share one physical slope: coefficient of function a in element e = scale(e, a) * nodal value.
//
// Units: mm for positions and for all their derivatives (xi has none).

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "estimator/mesh/hermite_basis.hpp"

namespace diastole {

using NodeField = std::vector<double>;
/// Coefficients of one element: row = component, column = Hermite function a.
using ElementField = Eigen::Matrix<double, 3, static_cast<int>(hermite_functions)>;

inline constexpr size_t dofs_per_node = 3 * nodal_derivatives;

constexpr size_t dof_of(size_t node, size_t derivative, size_t component) {
  return node * dofs_per_node + derivative * 3 + component;
}

/// A place that moves with the material.
struct MaterialPoint {
  size_t element = 0;
  Xi xi{};
};

/// One face of one element: xi_{direction} = side (0 or 1).
struct ElementFace {
  size_t element = 0;
  size_t direction = 0;
  size_t side = 0;
};

/// Faces that carry loads and supports; which of them exist depends on the kind of mesh.
struct MeshFaces {
  std::vector<ElementFace> inner;  ///< the cavity's wall
  std::vector<ElementFace> outer;
  std::vector<ElementFace> bottom;
  std::vector<ElementFace> top;
  std::vector<ElementFace> left;  ///< the ends of xi1, where it does not close on itself
  std::vector<ElementFace> right;
};

/// Where an edge of elements is collapsed to a point (the apex of a ventricle), its coincident nodes share
/// some nodal values, and derivatives along the edge vanish. Every field over the mesh keeps to this.
struct DofTies {
  std::vector<std::pair<size_t, size_t>> same;  ///< dof, and the (untied) dof of another node that it equals
  std::vector<size_t> zero;
};

class HermiteMesh {
 public:
  using Corners = std::array<size_t, corners>;
  using Scales = std::array<double, hermite_functions>;

  /// `elements[e][corner]` are node numbers; `scales` is empty when all scale factors are one.
  HermiteMesh(NodeField reference, std::vector<Corners> elements, MeshFaces faces,
              std::vector<Scales> scales = {}, DofTies ties = {});

  [[nodiscard]] size_t node_count() const { return reference_.size() / dofs_per_node; }
  [[nodiscard]] size_t element_count() const { return elements_.size(); }
  [[nodiscard]] const NodeField& reference() const { return reference_; }
  [[nodiscard]] const Corners& element(size_t e) const { return elements_[e]; }
  [[nodiscard]] const MeshFaces& faces() const { return faces_; }
  [[nodiscard]] double scale(size_t e, size_t a) const { return scales_.empty() ? 1.0 : scales_[e][a]; }
  [[nodiscard]] const DofTies& ties() const { return ties_; }
  /// The node that stands for all nodes at the same place: `node` itself unless its value is tied.
  [[nodiscard]] size_t place_of(size_t node) const { return places_[node]; }
  /// Largest extent of the reference body along x, y or z.
  [[nodiscard]] double extent_mm() const { return extent_mm_; }

  [[nodiscard]] ElementField gather(size_t e, std::span<const double> field) const;

  /// Value of a field at a material point: the position for a field of positions, du/dp for a sensitivity...
  [[nodiscard]] Eigen::Vector3d value(std::span<const double> field, const MaterialPoint& point) const;
  /// d(field)/d(xi): row = component, column = xi direction.
  [[nodiscard]] Eigen::Matrix3d xi_gradient(std::span<const double> field, const MaterialPoint& point) const;
  /// d(field)/dX in the reference configuration: for deformed positions this is F = dx/dX.
  [[nodiscard]] Eigen::Matrix3d reference_gradient(std::span<const double> field,
                                                   const MaterialPoint& point) const;

 private:
  NodeField reference_;
  std::vector<Corners> elements_;
  MeshFaces faces_;
  std::vector<Scales> scales_;
  DofTies ties_;
  std::vector<size_t> places_;
  double extent_mm_ = 0.0;
};

/// Nodes of a face's element that lie on it: corner numbers in the order of the two other directions.
std::array<size_t, 4> face_corners(const ElementFace& face);

}  // namespace diastole
