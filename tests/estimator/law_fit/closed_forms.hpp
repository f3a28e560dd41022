#pragma once
// What bench tests of a Mooney-Rivlin body show, W = C1 (I1 - 3) + C2 (I2 - 3), in closed form; C2 = 0 is neo-Hookean.
// R. S. Rivlin, Phil. Trans. R. Soc. A 241 (1948) 379 and 242 (1949) 173. Nothing here is the estimator's.

#include <cmath>
#include <numbers>

namespace diastole::test {

struct Mooney {
  double C1_kPa, C2_kPa;

  [[nodiscard]] double uniaxial_kPa(double l) const { return 2 * (C1_kPa + C2_kPa / l) * (l - 1 / (l * l)); }
  [[nodiscard]] double planar_kPa(double l) const { return 2 * (C1_kPa + C2_kPa) * (l - std::pow(l, -3)); }
  /// The first of two pulls.
  [[nodiscard]] double biaxial_kPa(double l1, double l2) const {
    return 2 * (C1_kPa + C2_kPa * l2 * l2) * (l1 - 1 / (l1 * l1 * l1 * l2 * l2));
  }
  [[nodiscard]] double shear_kPa(double k) const { return 2 * (C1_kPa + C2_kPa) * k; }

  /// A cylinder of the unloaded radius a, stretched by l, turned by so much a unit of its unloaded length.
  [[nodiscard]] double moment_Nmm(double a_mm, double l, double turn_rad_mm) const {
    return 1e-3 * std::numbers::pi * turn_rad_mm * std::pow(a_mm, 4) * (C1_kPa * l + C2_kPa) / (l * l);
  }
  [[nodiscard]] double torsion_force_N(double a_mm, double l, double turn_rad_mm) const {
    const double r2 = a_mm * a_mm / l, turn2 = turn_rad_mm * turn_rad_mm;
    const double first = (l * l - 1 / l) * r2 - turn2 * r2 * r2 / 4;
    const double second = (1 / (l * l) - l) * r2 + turn2 / l * r2 * r2 / 2;
    return 1e-3 * 2 * std::numbers::pi * (C1_kPa * first - C2_kPa * second);
  }

  /// A tube with unloaded radii a and b, stretched by l, whose outer radius is now r.
  [[nodiscard]] double pressure_kPa(double a_mm, double b_mm, double l, double r_mm) const {
    const double K = l * r_mm * r_mm - b_mm * b_mm, in = a_mm * a_mm + K, out = b_mm * b_mm + K;
    const double shape = std::log(b_mm / a_mm) - (std::log(out / in) + K / out - K / in) / 2;
    return 2 * (C1_kPa + l * l * C2_kPa) / l * shape;
  }
  /// Of a neo-Hookean tube, without what the pressure does on its ends.
  [[nodiscard]] double tube_force_N(double a_mm, double b_mm, double l, double r_mm) const {
    const double K = l * r_mm * r_mm - b_mm * b_mm, in = a_mm * a_mm + K, out = b_mm * b_mm + K;
    const double area = b_mm * b_mm - a_mm * a_mm;
    const double hoop = area + K * std::log(b_mm / a_mm) - K / 2 * std::log(out / in);
    return 1e-3 * 2 * std::numbers::pi * C1_kPa * (l * area - hoop / (l * l));
  }
};

}  // namespace diastole::test
