#include "tools/sim_rig/plant/gel_annulus.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace diastole::sim_rig {
namespace {

constexpr double inner_radius_mm = 22.5;
constexpr double outer_radius_mm = 50.0;
constexpr double height_mm = 85.0;

/// p / C1 of the infinite cylinder and its derivative with respect to the volume, 1/mL.
struct PlaneStrain {
  double pressure;
  double slope_per_mL;
};

constexpr double mm2_per_mL = 1000 / (std::numbers::pi * height_mm);

PlaneStrain plane_strain(double inflation_mL, double inner_mm = inner_radius_mm) {
  const double c = inflation_mL * mm2_per_mL;
  const double a2 = inner_mm * inner_mm + c;
  const double b2 = outer_radius_mm * outer_radius_mm + c;
  const double log_ratio =
      0.5 * std::log(outer_radius_mm * outer_radius_mm * a2 / (inner_mm * inner_mm * b2));
  const double pressure = 2 * (log_ratio + 0.5 * c * (1 / a2 - 1 / b2));
  const double slope = 2 * (1 / a2 - 1 / b2) - c * (1 / (a2 * a2) - 1 / (b2 * b2));
  return {pressure, slope * mm2_per_mL};
}

/// p / C1 of a stiffening wall: the integral of 2 exp(beta (I1 - 3)) (l^2 - 1/l^2) dr/r, l = r/R, by Simpson's rule.
double stiffening_pressure(double inflation_mL, double inner_mm, double beta) {
  constexpr int intervals = 32;
  const double c = inflation_mL * mm2_per_mL;
  const double h = (outer_radius_mm - inner_mm) / intervals;
  double sum = 0;
  for (int i = 0; i <= intervals; ++i) {
    const double R = inner_mm + h * i;
    const double r2 = R * R + c;
    const double l2 = r2 / (R * R);
    const double integrand = 2 * std::exp(beta * (l2 + 1 / l2 - 2)) * (l2 - 1 / l2) * R / r2;
    sum += integrand * (i == 0 || i == intervals ? 1 : (i % 2 == 1 ? 4 : 2));
  }
  return sum * h / 3;
}

PlaneStrain plane_strain(double inflation_mL, const GelShape& shape) {
  const double inner_mm = inner_radius_mm * (1 + shape.inner_radius_part);
  if (shape.stiffening == 0) return plane_strain(inflation_mL, inner_mm);
  constexpr double step_mL = 0.01;
  const auto at = [&](double volume_mL) {
    return stiffening_pressure(volume_mL, inner_mm, shape.stiffening);
  };
  return {at(inflation_mL), (at(inflation_mL + step_mL) - at(inflation_mL - step_mL)) / (2 * step_mL)};
}

struct Point {
  double inflation_mL;
  double pressure_per_C1;
};
constexpr std::array<Point, 3> converged{{{23.883, 3.1 / 8.8}, {35.761, 0.5}, {78.351, 6 / 6.5}}};

/// The bonded ends' factor: value and derivative of the parabola through the converged points.
struct EndStiffening {
  double factor;
  double slope_per_mL;
};

EndStiffening end_stiffening(double inflation_mL) {
  static const std::array<double, 3> ratio = [] {
    std::array<double, 3> r{};
    for (size_t i = 0; i < r.size(); ++i) {
      r[i] = converged[i].pressure_per_C1 / plane_strain(converged[i].inflation_mL).pressure;
    }
    return r;
  }();
  const auto& [p0, p1, p2] = converged;
  const double first = (ratio[1] - ratio[0]) / (p1.inflation_mL - p0.inflation_mL);
  const double second = ((ratio[2] - ratio[1]) / (p2.inflation_mL - p1.inflation_mL) - first) /
                        (p2.inflation_mL - p0.inflation_mL);
  const double from_0 = inflation_mL - p0.inflation_mL;
  const double from_1 = inflation_mL - p1.inflation_mL;
  return {ratio[0] + from_0 * (first + from_1 * second), first + second * (from_0 + from_1)};
}

EndStiffening end_stiffening(double inflation_mL, const GelShape& shape) {
  const EndStiffening bonded = end_stiffening(inflation_mL);
  if (shape.bond_left == 1) return bonded;
  return {1 + shape.bond_left * (bonded.factor - 1), shape.bond_left * bonded.slope_per_mL};
}

}  // namespace

double GelAnnulus::pressure_kPa(double inflation_mL) const {
  return C1_kPa_ * end_stiffening(inflation_mL, shape_).factor * plane_strain(inflation_mL, shape_).pressure;
}

double GelAnnulus::stiffness_kPa_per_mL(double inflation_mL) const {
  const EndStiffening ends = end_stiffening(inflation_mL, shape_);
  const PlaneStrain plane = plane_strain(inflation_mL, shape_);
  return C1_kPa_ * (ends.factor * plane.slope_per_mL + ends.slope_per_mL * plane.pressure);
}

double GelAnnulus::energy_mJ(double inflation_mL) const {
  constexpr int intervals = 200;  // Simpson's rule on a smooth curve: error far below 1e-9 of the energy
  const double h = inflation_mL / intervals;
  double sum = pressure_kPa(0) + pressure_kPa(inflation_mL);
  for (int i = 1; i < intervals; ++i)
    sum += (i % 2 == 1 ? 4 : 2) * pressure_kPa(h * i);
  return sum * h / 3;
}

}  // namespace diastole::sim_rig
