#include "estimator/rig_fit/linear_basis.hpp"

#include <cmath>

namespace diastole::rig {

Eigen::MatrixXd basis_of(const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd basis(columns.rows(), columns.cols());
  Eigen::Index count = 0;
  for (Eigen::Index c = 0; c < columns.cols(); ++c) {
    Eigen::VectorXd column = columns.col(c);
    const double size = column.norm();
    if (!(size > 0.0) || !std::isfinite(size)) continue;
    for (int again = 0; again < 2; ++again)
      column -= basis.leftCols(count) * (basis.leftCols(count).transpose() * column);
    if (column.norm() < dependent * size) continue;
    basis.col(count++) = column.normalized();
  }
  return basis.leftCols(count);
}

}  // namespace diastole::rig
