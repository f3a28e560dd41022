#pragma once
// A fibre field over a mesh's nodes from directions at points, whose signs have no meaning: weighted least squares of helix and transverse
// angle. Second differences between neighbouring nodes of 10 degrees count as one measurement each: nothing where points are dense, and what
// fills holes between them.

#include <Eigen/Dense>
#include <span>
#include <stdexcept>

#include "estimator/mesh/fibre_field.hpp"

namespace diastole {

struct FibrePoint {
  Eigen::Vector3d place_mm;
  Eigen::Vector3d direction;  ///< of any length but zero
  double sigma_deg = 1.0;     ///< > 0
};

struct FibresThroughPoints {
  FibreField fibres;
  size_t used = 0;     ///< points in the mesh, or within a quarter element of it
  double rms_deg = 0;  ///< between the points' directions and the field's
};

/// Throws std::invalid_argument if fewer than 8 points lie in the mesh, or fewer than a fifth of them: they are another specimen's.
FibresThroughPoints fibres_through_points(const HermiteMesh& mesh, std::span<const FibrePoint> points);

}  // namespace diastole
