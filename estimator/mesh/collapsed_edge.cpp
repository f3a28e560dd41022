#include "estimator/mesh/collapsed_edge.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace diastole {

bool is_collapsed(const HermiteMesh& mesh, const MaterialPoint& point, double least_relative_volume) {
  const Eigen::Matrix3d tangents = mesh.xi_gradient(mesh.reference(), point);
  return !(tangents.determinant() > least_relative_volume * std::pow(tangents.norm(), 3));
}

MaterialPoint beside_collapse(const HermiteMesh& mesh, MaterialPoint point, double beside) {
  if (!is_collapsed(mesh, point)) return point;
  for (double& xi : point.xi)
    xi = std::clamp(xi, beside, 1.0 - beside);
  return point;
}

}  // namespace diastole
