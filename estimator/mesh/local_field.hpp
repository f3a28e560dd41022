#pragma once
// A field at a place of one element, summed one direction at a time (N_a is a product of three cubic functions).

#include <Eigen/Dense>
#include <array>
#include <span>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct LocalField {
  Eigen::Vector3d value;
  Eigen::Matrix3d slope;  ///< d(value)/d(xi): row = component, column = xi direction
};

LocalField local_field(const ElementField& coefficients, const Xi& xi);
/// Its value alone.
Eigen::Vector3d local_value(const ElementField& coefficients, const Xi& xi);

/// The 64 functions at a place.
std::array<double, hermite_functions> hermite_basis_values(const Xi& xi);

/// A field element by element, for many places.
std::vector<ElementField> element_fields(const HermiteMesh& mesh, std::span<const double> field);

}  // namespace diastole
