#pragma once
// The left ventricle as a thick truncated ellipsoid of revolution about z, apex down, cut at z = base_z_mm.
//
//      base  ___________ z = base            depth t = 0 (endocardium) ... 1 (epicardium):
//           |  |     |  |                        semi-axes a(t) across z, c(t) along z, linear in t
//           \  \  +  /  /   + origin          meridian angle 0 (apex) ... psi_base(t) = acos(-base/c(t)):
//            \  \___/  /                         X = (a sin psi cos theta, a sin psi sin theta, -c cos psi)
//             \_______/  apex z = -c(t)
//
// Element axes: xi1 anticlockwise about z, first node at y = 0, x > 0; xi2 from apex to base;
// xi3 outwards, t uniform. psi = psi_base [(1 - g) s + g sin(pi s / 2)] with s uniform in 0..1: elements
// shrink by the grading g towards the held base, where the stress is singular. The cubic edges have the
// tangents of Bezier arcs (4 tan(h/4) per xi for an arc of angle h, exact up to the affine map of a circle to
// an ellipse). faces().top is the base, bottom is empty. Numbering: structured.hpp, closed.
//
// The apex. The edge xi2 = 0 of the elements around it is collapsed onto the axis: its n1 nodes of each layer
// are at one place, share value and d/dxi3, and have d/dxi1 = d2/dxi1 dxi3 = 0 (HermiteMesh::ties). Every
// node keeps its own d/dxi2 (the direction of its meridian), and the mixed derivatives with it. Affine maps
// keep to these ties, so that the mesh passes the patch test; 1/R in d xi1/dX is met by fields that vanish
// with R. Gauss points are off the axis.

#include <array>
#include <cstddef>

#include "estimator/mesh/fibre_field.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct EllipsoidShape {
  std::array<double, 2> inner_axes_mm{21.0, 51.0};  ///< across z, along z
  std::array<double, 2> outer_axes_mm{30.0, 60.0};
  double base_z_mm = 15.0;
  double base_grading = 0.8;                ///< g above, -1 <= g < 1; below 0: towards the apex
  std::array<size_t, 3> elements{8, 4, 2};  ///< circumferential (>= 3), longitudinal, transmural (>= 1)
};

/// Precondition: inner axes < outer axes, both positive; |base| < inner axis along z; the counts above.
HermiteMesh make_ellipsoid(const EllipsoidShape& shape);

/// Fibre angle linear in depth t: nodal values for the mesh of make_ellipsoid.
FibreField ellipsoid_fibres(const EllipsoidShape& shape, double endo_deg, double epi_deg);

}  // namespace diastole
