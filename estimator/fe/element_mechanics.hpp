#pragma once
// One element's share of the potential
//
//   Pi(x, p) = integral of  m W(C; parameters) + (1 - m) p0 (J - 1) + T Eff - p (J - 1) + kappa/2 (J - 1)^2  dV
//              - P_cavity V_cavity(x)
//
// (the last term is in cavity_load.hpp), with m a factor that may vary from place to place, T an active tension along the fibre (second Piola-Kirchhoff
// stress T f x f) and kappa a volume stiffness *beside* the Lagrange pressure: the exact solution, J = 1,
// does not know it, but Newton's method converges from farther away. Nor does it know the second term, with p0 the pressure that balances the
// law's stress at rest: without it a pressure would have to follow m from point to point to balance m W, which a tri-linear one cannot, and the
// material at rest would bulge within each element that an inclusion's edge goes through.
//
// Compressible material adds  - (p - p0)^2 / (2 K) dV  with K the bulk modulus: p = p0 - K (J - 1) in the weak sense (a perturbed Lagrangian), so that the material's energy is
// W - p0 (J - 1) + K/2 (J - 1)^2, and the incompressible one is its limit 1/K = 0.
//
// Given here are its gradient (residual)
// and second derivative (tangent) with respect to the 192 coefficients x(a, i) of the deformed position and
// the 8 corner values p(m) of the tri-linear Lagrange pressure p, positive in compression: Cauchy stress =
// 2/J F (dW/dC + T/2 f x f) F^T
// - (p - kappa (J - 1) - (1 - m) p0) I.
//
// Everything is worked out in element coordinates: g = dx/dxi, and T = dxi/dX Q with Q's columns the material
// axes, so that F Q = g T and C in material axes = (g T)^T (g T). With w the Gauss weight, G = dX/dxi:
//   residual(a, i) = sum_q dN_a/dxi_K [ w det G (g T S T^T)_iK - p w cof(g)_iK ],   p - kappa (J - 1) - (1 - m) p0 for p
//   residual(m)    = - sum_q w [ det g - det G + det G (p - p0) / K ] psi_m
//
// Units: mm, kPa; energies in kPa mm^3 = uJ.

#include <Eigen/Dense>
#include <array>
#include <functional>
#include <span>

#include "estimator/fe/gauss_points.hpp"
#include "estimator/fe/stiffness_contraction.hpp"
#include "estimator/materials/law.hpp"
#include "estimator/mesh/fibre_field.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// What a Gauss point keeps of the reference configuration.
struct ReferencePoint {
  Eigen::Matrix3d material_to_xi;  ///< T
  double volume = 0.0;             ///< w det G, mm^3
  double stiffness = 1.0;          ///< factor of the law's energy
};
using ReferenceElement = std::array<ReferencePoint, gauss_points>;

/// Material axes (orthonormal columns fibre, sheet, normal) at a Gauss point; identity for isotropic laws.
using MaterialAxes = Eigen::Matrix3d;
/// Empty: the coordinate axes everywhere.
using MaterialAxesField = std::function<MaterialAxes(const HermiteMesh&, const MaterialPoint&)>;
MaterialAxesField material_axes_of(FibreField fibres);

/// Factor of the law's energy at a place of the undeformed body, > 0; empty: 1 everywhere.
using StiffnessField = std::function<double(const Eigen::Vector3d& X_mm)>;

ReferenceElement make_reference_element(const HermiteMesh& mesh, size_t element,
                                        const MaterialAxesField& axes = {},
                                        const StiffnessField& stiffness = {});

struct ElementState {
  ElementField position_mm;
  std::array<double, corners> pressure_kPa;
  double fibre_tension_kPa = 0.0;        ///< T above
  double volume_stiffness_kPa = 0.0;     ///< kappa above
  double probing_stiffness_kPa = 0.0;    ///< added to kappa in the tangent's  kappa dJ x dJ  alone
  double compressibility_per_kPa = 0.0;  ///< 1/K above
  double rest_pressure_kPa = 0.0;        ///< p0 above; of no account when incompressible and m = 1 everywhere
};

/// The least volume ratio J over the Gauss points, and where.
struct LeastVolumeRatio {
  double ratio = 1.0;
  size_t point = 0;
};

struct ElementResidual {
  ElementField force;                      ///< dPi/dx, kPa mm^2
  std::array<double, corners> volume_mm3;  ///< dPi/dp
  double energy = 0.0;                     ///< integral of W, and of - p0 (J - 1) + (p - p0)^2 / (2 K)
  LeastVolumeRatio least;
};

/// Tangent blocks of one element; `stiffness` holds d2Pi/dx dx.
struct ElementTangent {
  StiffnessContraction stiffness;
  std::array<ElementField, corners> coupling;  ///< d2Pi/dx dp: coupling[m](i, a)
  /// d2Pi/dp dp, only set for compressible material.
  Eigen::Matrix<double, corners, corners> compliance;
};

ElementResidual element_residual(const ReferenceElement& reference, const ElementState& state, const Law& law,
                                 std::span<const double> parameters);

void element_tangent(const ReferenceElement& reference, const ElementState& state, const Law& law,
                     std::span<const double> parameters, ElementTangent& tangent);

/// Derivative of the residual's Piola stresses by m at each Gauss point, times its volume, by xi: force_of() of them, weighted, is
/// dR/dm of a field of m.
std::array<Eigen::Matrix3d, gauss_points> element_stiffness_forces(const ReferenceElement& reference,
                                                                   const ElementField& position_mm,
                                                                   const Law& law,
                                                                   std::span<const double> parameters);

/// Undeformed volume that each corner's pressure stands for, mm^3: integral of psi_m dV.
std::array<double, corners> pressure_volume_mm3(const ReferenceElement& reference);

/// d(residual force)/d(parameter) at fixed x and p.
ElementField element_parameter_force(const ReferenceElement& reference, const ElementState& state,
                                     const Law& law, std::span<const double> parameters, size_t parameter);

}  // namespace diastole
