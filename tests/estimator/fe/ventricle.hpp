#pragma once
// Truncated ellipsoids with fibres, for the tests.

#include <utility>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/mesh/ellipsoid.hpp"

namespace diastole {

inline ElasticModel ventricle(const EllipsoidShape& shape, std::array<double, 2> fibre_deg,
                              std::vector<double> guccione, ElasticOptions options = {}) {
  options.parameters = std::move(guccione);
  options.solve.check_stability = true;
  options.material_axes = material_axes_of(ellipsoid_fibres(shape, fibre_deg[0], fibre_deg[1]));
  return ElasticModel(make_ellipsoid(shape), *find_law("guccione"), std::move(options));
}

/// The body of problems 2 and 3 of S. Land et al., Proc. R. Soc. A 471 (2015) 20150641.
inline EllipsoidShape land_ellipsoid(std::array<size_t, 3> elements) {
  EllipsoidShape shape;
  shape.inner_axes_mm = {7.0, 17.0};
  shape.outer_axes_mm = {10.0, 20.0};
  shape.base_z_mm = 5.0;
  shape.elements = elements;
  return shape;
}

}  // namespace diastole
