#pragma once
// A rectangular block with edges along x, y, z: specimens of homogeneous tests, and the beam.
//
// xi1, xi2, xi3 run along x, y, z from the corner at the origin; left/right are the x faces, bottom/top the y
// faces, inner/outer the z faces. Numbering: structured.hpp, open.

#include <array>
#include <cstddef>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct BlockShape {
  std::array<double, 3> size_mm{1.0, 1.0, 1.0};
  std::array<size_t, 3> elements{1, 1, 1};
};

/// Precondition: positive sizes and counts.
HermiteMesh make_block(const BlockShape& shape);

}  // namespace diastole
