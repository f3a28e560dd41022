#pragma once
// The Sobolev norm that keeps a reconstructed field smooth where there are few data (S of the paper's Eq. 2):
//
//   S(u) = 1/V ∫ [ w1 |∂u/∂X|² + w2 L² |∂²u/∂X²|² ] dV        over the undeformed body, V its volume
//
// dimensionless, with derivatives in space and not in xi, so that neither the mesh's element sizes nor the turning of
// the specimen change what "smooth" means. |.|² is the sum of squares of all components. With w1 = 0 every
// affine motion is free. L is only a unit: it makes w1 and w2 comparable.

#include "estimator/reconstruction/field_space.hpp"

namespace diastole {

struct SobolevWeights {
  double first = 0.02;      ///< w1 >= 0
  double second = 1.0;      ///< w2 >= 0; not both zero
  double length_mm = 10.0;  ///< L
};

struct SobolevForms {
  QuadraticForms::Values smoothness;   ///< qᵀ S q = S(u)
  QuadraticForms::Values mean_square;  ///< qᵀ M q = 1/V ∫ |u|² dV, mm²
  std::vector<double> element_volume_mm3;
  double volume_mm3 = 0.0;
};

/// Integrated at 4x4x4 Gauss points an element.
SobolevForms sobolev_forms(const FieldSpace& space, const QuadraticForms& forms,
                           const SobolevWeights& weights);

}  // namespace diastole
