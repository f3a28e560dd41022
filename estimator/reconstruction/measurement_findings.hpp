#pragma once
// What a measurement says against itself and against its specimen, before anything is computed from it: some
// milliseconds. What only the motion shows is in motion_findings.hpp.
//
// ids: length-unit, tag-planes, sigma, sigma-range, duplicate-rows, repeated-frame, missing-frames, sparse-frames,
// unloaded-frames, pressure-at-rest, negative-pressure, outside-wall.

#include <vector>

#include "estimator/io/finding.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// Sound data give an empty list. Precondition: at least one frame.
std::vector<Finding> measurement_findings(const Measurement& measurement, const HermiteMesh& mesh);

}  // namespace diastole
