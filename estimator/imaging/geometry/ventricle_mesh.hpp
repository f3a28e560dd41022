#pragma once
// The tri-cubic Hermite mesh of a ventricle's wall, and what it measures.
//
// Element axes, apex and numbering are those of estimator/mesh/ellipsoid.hpp: xi1 anticlockwise seen from the base, xi2 from the
// apex to the base plane, xi3 outwards, straight. faces().inner is the endocardium, outer the epicardium, top the base. Nodes have
// the walls' places and tangents (scaled as those of Bezier arcs); an ellipsoid of revolution in comes out as make_ellipsoid's.

#include <array>
#include <optional>
#include <vector>

#include "estimator/imaging/geometry/ventricle_fit.hpp"
#include "estimator/mesh/mesh_file.hpp"

namespace diastole::imaging {

struct VentricleMeshOptions {
  std::array<size_t, 3> elements{8, 5,
                                 2};  ///< around (>= 3), from apex to base (>= 2), through the wall (>= 1)
  double base_grading = 0.8;          ///< elements shrink towards the base (EllipsoidShape::base_grading)
};

/// In patient coordinates. Throws std::domain_error if a wall does not meet the base plane.
HermiteMesh ventricle_mesh(const ProlateFrame& frame, const VentricleWalls& walls,
                           const VentricleMeshOptions& options);

/// One a node: the standard deviation of its place along the wall's normal.
std::vector<double> node_sigmas_mm(const ProlateFrame& frame, const VentricleWalls& walls,
                                   const VentricleMeshOptions& options);

struct MeshMeasures {
  double cavity_mL = 0;  ///< closed by the base plane
  double wall_mL = 0;
  /// The least volume of the three unit tangents, of 125 places in each element: negative where an element is folded.
  double least_jacobian = 0;
  MaterialPoint least_at;
};
MeshMeasures measure_mesh(const HermiteMesh& mesh);

/// Of the mesh's walls from the fitted ones: what its elements are too coarse for.
double mesh_error_mm(const ProlateFrame& frame, const VentricleWalls& walls, const HermiteMesh& mesh);

/// Points on the mesh's endocardium (side 0) or epicardium (side 1), some five a centimetre apart each way.
std::vector<Eigen::Vector3d> surface_points(const HermiteMesh& mesh, size_t side);

}  // namespace diastole::imaging
