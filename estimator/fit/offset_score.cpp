#include "estimator/fit/offset_score.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/inference/covariance.hpp"

namespace diastole {

std::optional<OffsetScore> offset_score(const JointProblem& problem, const Eigen::VectorXd& q,
                                        const LinearProblem& linear, const Eigen::VectorXd& column) {
  if (problem.frames().size() < 2) return {};
  const std::optional<Frame>& rest = problem.rest_reading();
  const Eigen::Index rows = linear.jacobian.rows(), unknowns = q.size();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows + (rest ? 1 : 0), unknowns + 1);
  Eigen::VectorXd residuals(jacobian.rows());
  jacobian.topLeftCorner(rows, unknowns) = linear.jacobian;
  jacobian.col(unknowns).head(rows) = column;
  residuals.head(rows) = linear.residuals;
  if (rest) {
    jacobian(rows, unknowns) = 1 / rest->sigma_kPa;
    residuals[rows] = -rest->pressure_kPa / rest->sigma_kPa;
  }
  std::vector<bool> is_free = linear.is_free;
  is_free.push_back(true);
  const Eigen::MatrixXd inverse = inference::estimate_covariance(jacobian, is_free).matrix;
  const double variance = inverse(unknowns, unknowns);
  if (!(variance > 0) || !std::isfinite(variance)) return {};
  const Eigen::VectorXd change = -inverse * (jacobian.transpose() * residuals);
  OffsetScore score{change[unknowns], std::sqrt(std::max(1.0, linear.variance_factor) * variance), {}};
  for (Eigen::Index i = 0; i < problem.values(); ++i)
    score.values.push_back(problem.space()[i].value(q[i] + change[i]));
  return score;
}

}  // namespace diastole
