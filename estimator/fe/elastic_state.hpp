#pragma once
// An equilibrium, or an iterate on the way to one.

#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct ElasticState {
  double pressure_kPa = 0.0;                  ///< cavity pressure
  NodeField position_mm;                      ///< deformed positions and their xi derivatives
  std::vector<double> lagrange_pressure_kPa;  ///< corner values, numbered by the PressureMap
};

}  // namespace diastole
