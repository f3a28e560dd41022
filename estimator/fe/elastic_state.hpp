#pragma once
// An equilibrium, or an iterate on the way to one.

#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// What drives a specimen.
struct Load {
  double pressure_kPa = 0.0;       ///< cavity pressure, positive outwards
  double fibre_tension_kPa = 0.0;  ///< active second Piola-Kirchhoff stress along the fibre, everywhere
};

struct ElasticState {
  double pressure_kPa = 0.0;                  ///< cavity pressure
  double fibre_tension_kPa = 0.0;             ///< active tension along the fibre
  NodeField position_mm;                      ///< deformed positions and their xi derivatives
  std::vector<double> lagrange_pressure_kPa;  ///< corner values, numbered by the PressureMap
};

}  // namespace diastole
