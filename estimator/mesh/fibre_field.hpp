#pragma once
// Fibre directions of a wall as nodal angles, tri-linear within elements.
//
// Wall coordinates at a material point, from the mesh itself: e_c along dX/dxi1 (circumferential), r normal
// to the surface xi3 = const and outwards, e_l = r x e_c in the wall, on the side of xi2 (longitudinal):
//
//        e_l ^   / f          f =  cos(alpha) e_c + sin(alpha) e_l       fibre
//            |  / alpha       s = -sin(alpha) e_c + cos(alpha) e_l       cross-fibre, r x f
//            | /)             r out of the page                          f, s, r right-handed
//            +-------> e_c
//
// The material axes are (f, s, r), or, with a sheet angle beta, (f, cos(beta) s + sin(beta) r,
// -sin(beta) s + cos(beta) r): beta = 90 makes the second axis, the sheet of orthotropic laws, transmural.
// With a transverse angle gamma the fibre leaves the surface, f = cos(gamma) (cos(alpha) e_c + sin(alpha) e_l) +
// sin(gamma) r, and r above becomes f x s.

#include <Eigen/Dense>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/mesh/refinement.hpp"

namespace diastole {

/// Columns e_c, e_l, r of the reference configuration. Precondition: the point is not on a collapsed edge.
Eigen::Matrix3d wall_axes(const HermiteMesh& mesh, const MaterialPoint& point);

class FibreField {
 public:
  /// One angle a node of the mesh that it will be used with; `sheet_deg` and `transverse_deg` may be empty (0 everywhere).
  explicit FibreField(std::vector<double> fibre_deg, std::vector<double> sheet_deg = {},
                      std::vector<double> transverse_deg = {});

  [[nodiscard]] const std::vector<double>& nodal_fibre_deg() const { return fibre_deg_; }
  /// Empty if it is 0 everywhere.
  [[nodiscard]] const std::vector<double>& nodal_sheet_deg() const { return sheet_deg_; }
  [[nodiscard]] const std::vector<double>& nodal_transverse_deg() const { return transverse_deg_; }
  [[nodiscard]] double fibre_deg(const HermiteMesh& mesh, const MaterialPoint& point) const;
  /// The same directions over the finer mesh.
  [[nodiscard]] FibreField prolonged(const Refinement& refinement) const;
  /// Columns: the law's axes, fibre first.
  [[nodiscard]] Eigen::Matrix3d material_axes(const HermiteMesh& mesh, const MaterialPoint& point) const;

 private:
  std::vector<double> fibre_deg_;
  std::vector<double> sheet_deg_;
  std::vector<double> transverse_deg_;
};

}  // namespace diastole
