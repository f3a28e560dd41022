#pragma once
// The tri-linear Lagrange pressure: eight values an element, either its own (discontinuous) or shared at the
// nodes. Corners that coincide on a collapsed edge share one value either way, so that the pressure is single
// there. docs/decisions/ has the comparison; the solver's default is the discontinuous one.

#include <array>
#include <cstddef>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

enum class PressureSpace { per_element, continuous };

struct PressureMap {
  std::vector<std::array<size_t, corners>> unknown;  ///< unknown[e][corner]: number of the pressure value
  size_t count = 0;
};

PressureMap make_pressure_map(const HermiteMesh& mesh, PressureSpace space);

}  // namespace diastole
