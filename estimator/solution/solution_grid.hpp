#pragma once
// A solution as a grid of Bezier hexahedra: undeformed geometry and displacement exactly (so that warping by
// displacement_mm shows the deformed body exactly), the state's Lagrange pressure exactly, strain and stress as the
// cubic through their values at the 4x4x4 Gauss points of each element.
//
// Point data: displacement_mm, cauchy_stress_kPa and green_strain (xx, yy, zz, xy, yz, xz), fibre_direction
// (undeformed; with fibres), and the scalars of scalar_field_names(). Cell data: element, one value for each
// parameter of the law. Field data: pressure_kPa.

#include <span>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/vtkhdf_file.hpp"

namespace diastole {

struct SolvedFrame {
  double time_s = 0.0;
  ElasticState state;  ///< stresses are best drawn from with_averaged_pressure()
};

/// Precondition: at least one frame; states are this model's.
BezierGrid solution_grid(const ElasticModel& model, std::span<const SolvedFrame> frames);

}  // namespace diastole
