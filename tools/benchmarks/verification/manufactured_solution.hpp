#pragma once
// A solution made up beforehand, and the loads that make it one: how fast do displacement and pressure converge?
//
// A unit cube (mm) deforms by three shears one after the other,
//
//   x = X + a sin(2 Y + Z),   y = Y + b sin(2 x - Z),   z = Z + c sin(x + 2 y),       a, b, c = 0.12, 0.1, 0.1 mm,
//
// so that det F = 1 everywhere, with a Lagrange pressure p chosen at will. The faces X = 0, Y = 0, Z = 0 are bonded
// to their (curved) places; body force and the tractions of the other three faces are those that the stress
// P = F S(F) - p cof F needs. They enter the discrete equations as one vector, integral of P : dN_a/dX dV, which by
// the divergence theorem is body force and tractions together.
//
// Errors are those of the discrete solution against the made-up one: displacement in L2 (mm) and in H1 (its gradient),
// pressure and stress in L2 (kPa), each divided by the cube's volume's root.

#include <cstddef>
#include <string>
#include <vector>

#include "estimator/fe/elastic_model.hpp"

namespace diastole {

struct ManufacturedCase {
  std::string name;
  const Law* law = nullptr;
  std::vector<double> parameters;
  bool fibres_turn = false;        ///< from +60 to -60 degrees about z through the thickness; else along x
  double pressure_wave_kPa = 0.0;  ///< amplitude of p's sine; 0: p is tri-linear, so that its space holds it
};

/// Neo-Hookean and Guccione's law (turning fibres), each with a curved and with a tri-linear pressure.
std::vector<ManufacturedCase> manufactured_cases();

struct ManufacturedErrors {
  bool converged = false;
  size_t unknowns = 0;
  size_t negative_pivots = 0;
  size_t pressure_unknowns = 0;
  double displacement_L2_mm = 0.0;
  double displacement_H1 = 0.0;
  double pressure_L2_kPa = 0.0;
  double averaged_pressure_L2_kPa = 0.0;  ///< estimator/fe/point_fields.hpp
  double stress_L2_kPa = 0.0;             ///< Cauchy stress with that pressure
};

/// Solves a case on n x n x n elements.
ManufacturedErrors solve_manufactured(const ManufacturedCase& made_up, size_t n);

/// log2-like order between two meshes: ln(coarse / fine) / ln(fine_n / coarse_n).
double convergence_order(double coarse, double fine, size_t coarse_n, size_t fine_n);

}  // namespace diastole
