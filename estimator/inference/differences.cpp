#include "estimator/inference/differences.hpp"

namespace diastole::inference {

Eigen::MatrixXd central_differences(LeastSquaresProblem& problem, const Eigen::VectorXd& q) {
  constexpr double step = 1e-6;
  Eigen::MatrixXd result;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const Eigen::VectorXd by = step * Eigen::VectorXd::Unit(q.size(), i);
    const Eigen::VectorXd column =
        (problem.residuals(q + by).value() - problem.residuals(q - by).value()) / (2 * step);
    result.conservativeResize(column.size(), q.size());
    result.col(i) = column;
  }
  return result;
}

}  // namespace diastole::inference
