#pragma once
// How an element's residual changes with its undeformed shape: the derivative of element_mechanics.hpp's gradient by the 192
// coefficients X(b, j) of the reference position, at fixed x and p. It drives the search for a stress-free shape
// (unloaded_shape.hpp) and what such a shape does to a fit's sensitivities.
//
// The material axes are known in the body as it was imaged, with gradients h = dx_imaged/dxi and axes A there, and are carried back
// with the material, first axis and plane of the first two: with F^-1 = G h^-1 and  A^T F^-T F^-1 A = R^T R  (R upper triangular),
//
//   axes of the undeformed body   Q = F^-1 A R^-1          T = G^-1 Q = h^-1 A R^-1        dT = - T dR R^-1
//
// so that  P_iK = w det G (g T S T^T)_iK - (p - kappa (J - 1)) w cof(g)_iK  depends on G = dX/dxi through det G and R alone.
// Units: mm, kPa. Passive material: no fibre tension.

#include <Eigen/Dense>

#include "estimator/fe/element_mechanics.hpp"

namespace diastole {

struct ReferenceTangent {
  Eigen::MatrixXd force;  ///< 192 x 192, row 3 a + i: dPi/dx(a, i), column 3 b + j: by X(b, j); kPa mm
  Eigen::Matrix<double, corners, 192> volume;  ///< of dPi/dp(m), mm^2
};

/// Axes of the body as it was imaged (orthonormal columns) as they lie in `reference` at the same material point, and
/// T = dxi/dX Q. Precondition: neither body is inside out there.
MaterialAxes carried_back(const Eigen::Matrix3d& reference_gradient, const Eigen::Matrix3d& imaged_gradient,
                          const MaterialAxes& imaged_axes);

/// The axes of the imaged body's field, carried back to whatever reference mesh asks for them. Without a field: none.
MaterialAxesField carried_back(const HermiteMesh& imaged, MaterialAxesField axes);

/// `reference_mm`, `imaged_mm`: coefficients of the undeformed body and of the body as it was imaged.
void reference_tangent(const HermiteMesh& imaged, size_t element, const ElementField& reference_mm,
                       const MaterialAxesField& imaged_axes, const ElementState& state, const Law& law,
                       std::span<const double> parameters, ReferenceTangent& tangent);

}  // namespace diastole
