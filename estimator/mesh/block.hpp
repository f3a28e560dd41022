#pragma once
// A rectangular block with edges along x, y, z: specimens of homogeneous tests, and the beam.
//
// xi1, xi2, xi3 run along x, y, z from the corner at the origin; left/right are the x faces, bottom/top the y
// faces, inner/outer the z faces. Numbering: structured.hpp, open.
//
// Grading: x(s) = L [(1 - g) s + g (1 - cos(pi s / 2))], 0 <= s <= 1: elements shrink towards x = 0, where a
// clamped face makes the stress singular.

#include <array>
#include <cstddef>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct BlockShape {
  std::array<double, 3> size_mm{1.0, 1.0, 1.0};
  std::array<size_t, 3> elements{1, 1, 1};
  double left_grading = 0.0;  ///< g above, 0 <= g < 1
};

/// Precondition: positive sizes and counts.
HermiteMesh make_block(const BlockShape& shape);

}  // namespace diastole
