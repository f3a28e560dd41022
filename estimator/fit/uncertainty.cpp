#include "estimator/fit/uncertainty.hpp"

#include <cmath>
#include <limits>

namespace diastole {

Eigen::MatrixXd covariance(const Eigen::MatrixXd& jacobian, const std::vector<bool>& is_free) {
  const Eigen::Index count = jacobian.cols();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(count, count);
  // Columns are scaled to length one first: unknowns have different units.
  Eigen::VectorXd length = jacobian.colwise().norm();
  std::vector<Eigen::Index> seen;
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!is_free[static_cast<size_t>(i)]) continue;
    if (length[i] > 0) {
      seen.push_back(i);
    } else {
      result(i, i) = std::numeric_limits<double>::infinity();
    }
  }
  const auto free_count = static_cast<Eigen::Index>(seen.size());
  Eigen::MatrixXd scaled(jacobian.rows(), free_count);
  for (Eigen::Index k = 0; k < free_count; ++k) {
    const Eigen::Index i = seen[static_cast<size_t>(k)];
    scaled.col(k) = jacobian.col(i) / length[i];
  }
  const Eigen::MatrixXd inverse =
      (scaled.transpose() * scaled).ldlt().solve(Eigen::MatrixXd::Identity(free_count, free_count));
  for (Eigen::Index k = 0; k < free_count; ++k) {
    for (Eigen::Index l = 0; l < free_count; ++l) {
      const Eigen::Index i = seen[static_cast<size_t>(k)], j = seen[static_cast<size_t>(l)];
      result(i, j) = inverse(k, l) / (length[i] * length[j]);
    }
  }
  return result;
}

double effective_count(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& data_jacobian) {
  double count = 0;
  const Eigen::MatrixXd information = data_jacobian.transpose() * data_jacobian;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    if (std::isfinite(covariance(i, i))) count += covariance.row(i).dot(information.col(i));
  }
  return count;
}

Eigen::MatrixXd correlation(const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    for (Eigen::Index j = 0; j < result.cols(); ++j) {
      const double product = sd[i] * sd[j];
      if (i != j) result(i, j) = product > 0 && std::isfinite(product) ? covariance(i, j) / product : 0.0;
    }
  }
  return result;
}

}  // namespace diastole
