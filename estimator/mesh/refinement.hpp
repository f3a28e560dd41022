#pragma once
// Halves every element along one direction and keeps the geometry, and every other field, exactly.
//
//   Refinement finer(mesh, 2);                       // twice as many elements through the wall
//   finer.mesh(), finer.prolonged(position_mm), finer.prolonged_corners(fibre_deg)
//
//   A --------------- B      along xi_k, old             low child 2 e, high child 2 e + 1 of element e;
//   A ------ M ------ B      new: xi = (xi' + side) / 2  old nodes keep their numbers, new ones follow
//
// A cubic is its own sum of two cubics: a field's nodal values that are differentiated along xi_k are halved
// (d/dxi' = 1/2 d/dxi), and the new node M takes value and derivatives of the cubic half-way,
//   M = 1/2 (A + B) + 1/8 (A_k - B_k),     dM/dxi' = 3/4 (B - A) - 1/8 (A_k + B_k).
// So the finer mesh's fields contain all of the coarser one's: spaces are nested. Faces keep their names. Ties
// of collapsed edges go on to the new nodes.

#include <cstddef>
#include <span>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

class Refinement {
 public:
  /// `direction` 0, 1 or 2. Throws std::invalid_argument when two elements cannot share the new node on an edge:
  /// their scale factors at its ends are in different proportion (the field is not smooth across the edge),
  /// or an element has one node at both ends.
  Refinement(const HermiteMesh& coarse, size_t direction);

  [[nodiscard]] const HermiteMesh& mesh() const { return mesh_; }
  /// A field over the coarse mesh as the same field over the finer one.
  [[nodiscard]] NodeField prolonged(std::span<const double> field) const;
  /// One number a node, tri-linear within elements: likewise.
  [[nodiscard]] std::vector<double> prolonged_corners(std::span<const double> values) const;

 private:
  /// The new node between two, and the scale factors that its first element has there (scale one at M).
  struct Midpoint {
    size_t low, high;
    std::array<double, nodal_derivatives> low_scale, high_scale;
  };
  struct Numbering;  // elements and scale factors of the finer mesh

  [[nodiscard]] Numbering number(const HermiteMesh& coarse);
  [[nodiscard]] MeshFaces faces(const MeshFaces& coarse) const;
  [[nodiscard]] DofTies ties(const HermiteMesh& coarse) const;

  size_t direction_;
  size_t coarse_nodes_;
  std::vector<Midpoint> midpoints_;
  HermiteMesh mesh_;
};

}  // namespace diastole
