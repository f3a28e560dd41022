#pragma once
// A sealed chamber around the specimen, filled with fluid that presses on the specimen's outer wall:
//
//   q = p0 + dV / C,      dV = V_fluid(X) - V_fluid(x)   what the specimen takes from the chamber by swelling
//
// with p0 the pressure in it at the specimen's undeformed shape, and C the compliance of the chamber: its walls,
// trapped air, the tubes that lead out of it. C infinite is an open chamber of constant pressure p0; C = 0 would
// forbid an incompressible specimen every inflation.
//
// q is an unknown beside the Lagrange pressures, so that the tangent stays sparse; its equation and the force q
// dV_fluid/dx derive from the potential  - q (V_fluid(x) - V_fluid(X)) - C/2 (q - p0)^2.

#include <limits>

namespace diastole {

struct Chamber {
  double sealing_pressure_kPa = 0.0;                                       ///< p0
  double compliance_mL_per_kPa = std::numeric_limits<double>::infinity();  ///< C > 0

  [[nodiscard]] bool sealed() const {
    return compliance_mL_per_kPa < std::numeric_limits<double>::infinity();
  }
};

}  // namespace diastole
