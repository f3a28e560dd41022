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

}  // namespace diastole
