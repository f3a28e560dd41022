#include "estimator/fe/pressure_space.hpp"

#include <map>
#include <utility>

namespace diastole {

PressureMap make_pressure_map(const HermiteMesh& mesh, PressureSpace space) {
  PressureMap map;
  std::map<std::pair<size_t, size_t>, size_t> unknowns;  // of an element (0 if continuous) and a place
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::array<size_t, corners> unknown;
    for (size_t c = 0; c < corners; ++c) {
      const size_t owner = space == PressureSpace::continuous ? 0 : e;
      const size_t place = mesh.place_of(mesh.element(e)[c]);
      unknown[c] = unknowns.try_emplace({owner, place}, unknowns.size()).first->second;
    }
    map.unknown.push_back(unknown);
  }
  map.count = unknowns.size();
  return map;
}

}  // namespace diastole
