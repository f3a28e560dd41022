#pragma once
// Strain and stress at every Gauss point as a CSV table: where the solver itself evaluates them.
//
//   frame,time_s,pressure_kPa,element,point,X_mm,Y_mm,Z_mm,ux_mm,uy_mm,uz_mm,volume_mm3,strain_cc,...
//
// One row a point, the columns after volume_mm3 (the point's share of the undeformed body) those of
// scalar_field_names(). Point q = q1 + 4 q2 + 16 q3 (fe/gauss_points.hpp).

#include <span>
#include <string>

#include "estimator/solution/solution_grid.hpp"

namespace diastole {

/// Precondition: states are this model's.
std::string gauss_table(const ElasticModel& model, std::span<const SolvedFrame> frames);

}  // namespace diastole
