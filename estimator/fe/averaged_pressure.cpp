#include "estimator/fe/averaged_pressure.hpp"

#include <map>
#include <set>
#include <utility>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {

ElasticState with_averaged_pressure(const ElasticSystem& system, const ElasticState& state) {
  const HermiteMesh& mesh = system.mesh();
  // Unknowns that meet at one place in one material; those of a collapsed edge's corners are one and count once.
  std::map<std::pair<size_t, std::vector<double>>, std::set<size_t>> meeting;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const std::span<const double> parameters = system.parameters(e);
    const std::vector<double> material(parameters.begin(), parameters.end());
    for (size_t m = 0; m < corners; ++m)
      meeting[{mesh.place_of(mesh.element(e)[m]), material}].insert(system.pressures().unknown[e][m]);
  }
  ElasticState averaged = state;
  for (const auto& [where, unknowns] : meeting) {
    double sum_kPa = 0.0;
    for (const size_t unknown : unknowns)
      sum_kPa += state.lagrange_pressure_kPa[unknown];
    for (const size_t unknown : unknowns)
      averaged.lagrange_pressure_kPa[unknown] = sum_kPa / static_cast<double>(unknowns.size());
  }
  return averaged;
}

}  // namespace diastole
