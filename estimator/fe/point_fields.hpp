#pragma once
// Strain and stress of a solution at a material point, in coordinate, wall and fibre axes.
//
//   F = dx/dX,  J = det F,  E = 1/2 (F^T F - 1)                           Green strain
//   sigma = 1/J F (2 dW/dC + T f0 x f0) F^T - (p - kappa (J - 1)) 1       Cauchy stress, element_mechanics.hpp
//
// Strain belongs to the reference configuration, and is given along its axes; Cauchy stress belongs to the
// deformed one, and is given along axes that the deformation carries with it:
//
//   axes     reference (columns)             deformed
//   wall     c0, l0, r0  estimator/mesh/fibre_field.hpp     c along F c0; r normal to the deformed surface xi3 = const; l = r x c
//   fibre    f0, s0, n0  material axes       f along F f0; n normal to F f0 and F s0; s = n x f
//
// so that sigma_rr at a free or pressed face is minus the pressure on it, and sigma_ff is the stress along the
// fibre as it lies now. With a sheet angle of 0 the third fibre axis is the wall's normal.
//
// A tensor in axes is stored as SymmetricTensor: 11, 22, 33, 12, 23, 31 of the columns. Units: mm, kPa.

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "estimator/fe/elastic_state.hpp"
#include "estimator/materials/law.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

class ElasticSystem;

/// Orthonormal columns before and after the deformation.
struct CarriedAxes {
  Eigen::Matrix3d reference;
  Eigen::Matrix3d deformed;
};

struct PointFields {
  Eigen::Vector3d reference_mm;
  Eigen::Vector3d displacement_mm;
  Eigen::Matrix3d deformation_gradient;
  double volume_ratio;           ///< J
  Eigen::Matrix3d green_strain;  ///< E along x, y, z
  Eigen::Matrix3d stress_kPa;    ///< sigma along x, y, z
  double lagrange_pressure_kPa;  ///< p
  CarriedAxes wall;
  std::optional<CarriedAxes> fibre;  ///< where the model has fibres
};

/// Precondition: the state is of this system and not inverted at the point, which is not on a collapsed edge.
PointFields point_fields(const ElasticSystem& system, const ElasticState& state, const MaterialPoint& point);

/// `state` with each corner's Lagrange pressure replaced by a mean: no equilibrium of the discrete equations, but what
/// point_fields() and all that is drawn from it should be given.
///
/// An element's own pressure carries, along each direction, a weakly controlled sawtooth: one linear function repeated in
/// all elements, which the volume of a C1 displacement hardly sees (docs/verification.md, orders of convergence). At a
/// node where elements meet, the mean of their values is free of it, and converges with order 2. The mean is taken over
/// elements of the same parameters only: where the material changes, its pressure jumps.
ElasticState with_averaged_pressure(const ElasticSystem& system, const ElasticState& state);

/// Components of a tensor along the columns of `axes`.
SymmetricTensor<double> along(const Eigen::Matrix3d& axes, const Eigen::Matrix3d& tensor);

/// What tables, files and plots call the scalar fields, in the order of scalar_fields(): strain_cc, strain_ll,
/// strain_rr, strain_cl, strain_lr, strain_rc, stress_cc_kPa ... stress_rc_kPa, lagrange_pressure_kPa,
/// volume_ratio; with fibres also strain_ff, ss, nn, fs, sn, nf, stress_ff_kPa ... stress_nf_kPa, fibre_stretch.
std::vector<std::string> scalar_field_names(bool fibres);
std::vector<double> scalar_fields(const PointFields& fields);

/// |F f0|: 1 + the relative elongation along the first reference axis.
double stretch_along_first(const PointFields& fields, const CarriedAxes& axes);

}  // namespace diastole
