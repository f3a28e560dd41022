#pragma once
// The four edges of an element face, and the integrals along them that a follower pressure needs at its rim.
//
//            2                 u, v: the face's two directions, (direction + 1) % 3 and (direction + 2) % 3
//       +---------+            edges run anticlockwise in (u, v): 0 along +u at v = 0, 1 along +v at u = 1,
//   v ^ |         |            2 along -u at v = 1, 3 along -v at u = 0
//     |3|         |1
//     | +---------+            All integrals carry the sign of the face's normal into the wall
//     |      0                 (cavity_load.hpp).
//     +---> u
//
// A wall meets a plate z = h. If its rim moves off the plate by z - h, the gap between rim and plate belongs to the
// fluid's boundary: a strip between the rim and its shadow on the plate, of volume
//
//   G(x) = integral along the rim of 1/2 (x y' - y x') (z - h) dt
//
// so that V(x) = 1/2 integral over the wall of (x n_x + y n_y) dA + G is the volume between wall and plates,
// exactly. On a closed rim dV/dx = integral of N_a n dA over the wall + integral of N_a (y', -x', 0) (z - h) dt: the
// pressure on wall and strip, with a symmetric derivative.
//
// A rim that is free instead leaves the follower pressure's tangent unsymmetric. From Green's theorem,
//
//   T(v, u) - T(u, v) = integral along the rim of (v x u) . x' dt,   T(v, u) = v . d(integral of n dA) along u
//
// 5 Gauss points are exact (degree 8). Units: mm, mm^2, mm^3.

#include <Eigen/Dense>
#include <array>
#include <cstddef>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

inline constexpr size_t edge_functions = 4;

struct FaceEdge {
  ElementFace face;
  size_t edge = 0;  ///< 0..3, drawn above
};

/// The 4 functions of the edge: value and slope at its beginning, value and slope at its end, along increasing
/// u or v (edges 2 and 3 are run through backwards).
std::array<size_t, edge_functions> edge_hermite_functions(const FaceEdge& edge);
/// The corners at its beginning and end, in the same order.
std::array<size_t, 2> edge_corners(const FaceEdge& edge);

using EdgeField = Eigen::Matrix<double, 3, static_cast<int>(edge_functions)>;
/// Row 3 a + i, column 3 b + k over the edge's functions.
using EdgeTangent = Eigen::Matrix<double, 3 * edge_functions, 3 * edge_functions>;

/// G; the area vectors that the edge's functions see on the strip; the symmetric part of their derivative (the
/// skew part cancels the wall's along a closed rim).
double gap_volume_mm3(const FaceEdge& edge, double plate_z_mm, const ElementField& position_mm);
EdgeField gap_area_mm2(const FaceEdge& edge, double plate_z_mm, const ElementField& position_mm);
EdgeTangent gap_tangent_mm(const FaceEdge& edge, double plate_z_mm, const ElementField& position_mm);

/// The skew part (T - T^T) / 2 that a free rim adds to the tangent of the integral of n dA.
EdgeTangent rim_skew_mm(const FaceEdge& edge, const ElementField& position_mm);

}  // namespace diastole
