#include "estimator/fe/pressure_space.hpp"

namespace diastole {

PressureMap make_pressure_map(const HermiteMesh& mesh, PressureSpace space) {
  PressureMap map;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::array<size_t, corners> unknown;
    for (size_t c = 0; c < corners; ++c) {
      unknown[c] = space == PressureSpace::continuous ? mesh.element(e)[c] : e * corners + c;
    }
    map.unknown.push_back(unknown);
  }
  map.count = space == PressureSpace::continuous ? mesh.node_count() : mesh.element_count() * corners;
  return map;
}

}  // namespace diastole
