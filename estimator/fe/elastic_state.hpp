#pragma once
// An equilibrium, or an iterate on the way to one.

#include <optional>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// What drives a specimen.
struct Load {
  double pressure_kPa = 0.0;       ///< cavity pressure, positive outwards
  double fibre_tension_kPa = 0.0;  ///< active second Piola-Kirchhoff stress along the fibre, everywhere
  /// If given, the cavity is brought to this volume; its pressure is found, and pressure_kPa of no account.
  std::optional<double> cavity_volume_mL{};
};

struct ElasticState {
  double pressure_kPa = 0.0;                  ///< cavity pressure: given, or an unknown if its volume is held
  std::optional<double> held_volume_mm3;      ///< of the cavity
  double sealing_pressure_kPa = 0.0;          ///< p0 of the chamber around the specimen (chamber.hpp)
  double chamber_pressure_kPa = 0.0;          ///< in it
  double fibre_tension_kPa = 0.0;             ///< active tension along the fibre
  NodeField position_mm;                      ///< deformed positions and their xi derivatives
  std::vector<double> lagrange_pressure_kPa;  ///< corner values, numbered by the PressureMap
};

}  // namespace diastole
