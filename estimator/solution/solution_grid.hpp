#pragma once
// A solution as a grid of Bezier hexahedra: undeformed geometry and displacement exactly (so that warping by
// displacement_mm shows the deformed body exactly), the state's Lagrange pressure exactly, strain and stress as the
// cubic through their values at the 4x4x4 Gauss points of each element.
//
// Point data: displacement_mm, cauchy_stress_kPa and green_strain (xx, yy, zz, xy, yz, xz), fibre_direction
// (undeformed; with fibres), and the scalars of scalar_field_names(). Cell data: element, one value for each
// parameter of the law. Field data: pressure_kPa.

#include <span>
#include <string>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/io/vtkhdf_file.hpp"

namespace diastole {

struct SolvedFrame {
  double time_s = 0.0;
  ElasticState state;  ///< stresses are best drawn from with_averaged_pressure()
};

/// The arrays that are sampled at a point beside its displacement, empty, and their numbers there, one array after the other.
std::vector<GridArray> sampled_arrays(bool fibres);
Eigen::VectorXd sampled_fields(const PointFields& fields);

/// Precondition: at least one frame; states are this model's.
BezierGrid solution_grid(const ElasticModel& model, std::span<const SolvedFrame> frames);

// Strain and stress at every Gauss point as a CSV table: where the solver itself evaluates them.
//
//   frame,time_s,pressure_kPa,element,point,X_mm,Y_mm,Z_mm,ux_mm,uy_mm,uz_mm,volume_mm3,strain_cc,...
//
// One row a point, the columns after volume_mm3 (the point's share of the undeformed body) those of
// scalar_field_names(). Point q = q1 + 4 q2 + 16 q3 (estimator/fe/gauss_points.hpp).

/// Precondition: states are this model's.
std::string gauss_table(const ElasticModel& model, std::span<const SolvedFrame> frames);

}  // namespace diastole
