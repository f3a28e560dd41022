#include "estimator/fe/body_volume.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "estimator/fe/gauss_points.hpp"

namespace diastole {

double volume_mm3(const HermiteMesh& mesh, const NodeField& position_mm) {
  const GaussTables& tables = gauss_tables();
  double sum = 0.0;
  for (size_t e = 0; e < mesh.element_count(); ++e)
    for (size_t q = 0; q < gauss_points; ++q)
      sum += tables.weight[q] * mesh.xi_gradient(position_mm, {e, tables.xi[q]}).determinant();
  return std::abs(sum);
}

}  // namespace diastole
