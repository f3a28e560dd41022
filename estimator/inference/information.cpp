#include "estimator/inference/information.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace diastole::inference {

Covariance covariance_of_information(const Eigen::MatrixXd& information) {
  constexpr double rounding = 1e-14;  // of the greatest eigenvalue, some dozens of unknowns
  const Eigen::VectorXd square = information.diagonal();
  const Eigen::VectorXd length = (square.array() > 0.0).select(square, 1.0).cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(
      length.cwiseInverse().asDiagonal() * information * length.cwiseInverse().asDiagonal());
  Eigen::VectorXd sizes = modes.eigenvalues();
  sizes = (sizes.array() > rounding * sizes.maxCoeff()).select(sizes, 0.0).cwiseSqrt();
  return estimate_covariance(sizes.asDiagonal() * modes.eigenvectors().transpose() * length.asDiagonal());
}

Eigen::MatrixXd information_of_covariance(const Eigen::MatrixXd& covariance) {
  std::vector<Eigen::Index> known;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    if (std::isfinite(covariance(i, i))) known.push_back(i);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  if (known.empty()) return information;
  const auto count = static_cast<Eigen::Index>(known.size());
  const Eigen::MatrixXd of_known = covariance(known, known);
  const Eigen::MatrixXd inverse = of_known.ldlt().solve(Eigen::MatrixXd::Identity(count, count));
  information(known, known) = inverse;
  return information;
}

double separation(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& known) {
  const Eigen::Index count = gram.rows() - 1;
  const Eigen::VectorXd g = gram.block(1, 0, count, 1);
  const Eigen::MatrixXd normal = gram.block(1, 1, count, count) + known;
  return std::sqrt(std::max(0.0, gram(0, 0) - g.dot(normal.ldlt().solve(g))));
}

}  // namespace diastole::inference
