#pragma once
// The gel phantom: a thick-walled cylinder about the z axis, mid-height at z = 0.
//
// Element axes: xi1 circumferential (anticlockwise seen from +z, first node at y = 0, x > 0), xi2 upwards,
// xi3 outwards. Node number = i1 + n1 (i2 + (n2 + 1) i3): around first, then up, then outwards; element
// number = i1 + n1 (i2 + n2 i3) likewise.
//
//      z ^   +----+----+  top          y ^    __
//        |   |    |    |                 |  /    \     inner and outer circles: cubic arcs of angle h with
//   xi2  |   +----+----+                 | | ( )  |    tangents 4 tan(h/4) R per xi, the ones of a Bezier arc
//        |   |    |    |                 |  \ __ /     (radius right to 4e-6 R at h = 45 deg)
//        +---+----+----+  bottom         +---------> x
//          xi3 -> R                        xi1
//
// Grading, from s = -1 (bottom) to 1 (top) and from t = 0 (inner) to 1 (outer face):
//   z(s) = H/2 [(1 - g) s + g sin(pi s / 2)]           smaller towards the plates: singular stress
//   R(t) = (1 - w) [A + (B - A) t] + w A (B/A)^t       smaller towards the cavity: displacement as 1/R
// Both are smooth, so that all scale factors are one (docs/decisions/0010-hermite-meshes-with-a-discontinuous-pressure.md).
// The defaults lie between two pairs that were measured on 8x4x1 at C1 = 6.5 kPa: the largest error of displacement at five radii, and
// what C1 is off by when displacements of 8x10x4 at 1500 random places are fitted:
//
//      w     g     displacement, 6 kPa    C1, 6 kPa    C1, 3.1 kPa
//     0.5   0.7    0.78 %                 +0.09 %      +0.04 %
//     0.5   0.8    0.71 %                 +0.02 %      -0.07 %
//     0     0      1.17 %                 +0.15 %      +0.12 %
//     1     0.8    0.75 %                 +0.10 %      +0.10 %

#include <array>
#include <cstddef>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct AnnulusShape {
  double inner_radius_mm = 22.5;
  double outer_radius_mm = 50.0;
  double height_mm = 85.0;
  std::array<size_t, 3> elements{8, 4,
                                 1};  ///< circumferential (>= 3), longitudinal (>= 1), transmural (>= 1)
  double plate_grading = 0.75;        ///< g above, 0 <= g < 1; 0 is uniform
  double wall_grading = 0.5;          ///< w above, 0 <= w <= 1; 0 is uniform
};

/// Precondition: 0 < inner < outer radius, height > 0, the element counts above.
HermiteMesh make_annulus(const AnnulusShape& shape);

/// A cylinder about z whose elements end where one says: finer around a place, graded anyhow. Nodal derivatives are
/// physical (per radian-like arc, per mm), elements scale them to their size.
struct AnnulusGrid {
  std::vector<double> angles_deg;  ///< of the nodes around, rising, less than 360 apart; at least three
  std::vector<double> heights_mm;  ///< rising, at least two
  std::vector<double> radii_mm;    ///< rising, > 0, at least two
};

HermiteMesh make_annulus_on(const AnnulusGrid& grid);

}  // namespace diastole
