#include "estimator/inference/linear_model.hpp"

#include <Eigen/QR>

namespace diastole::inference {

double LinearModel::expected_gain(const Eigen::VectorXd& step) const {
  const Eigen::VectorXd change = jacobian * step;
  return -2.0 * residuals.dot(change) - change.squaredNorm();
}

double LinearModel::greatest_gain(const std::vector<bool>& held) const {
  Eigen::VectorXd size = jacobian.colwise().norm();
  for (Eigen::Index i = 0; i < size.size(); ++i)
    size[i] = held[static_cast<size_t>(i)] || !(size[i] > 0) ? 0.0 : 1.0 / size[i];
  const Eigen::VectorXd gradient = size.cwiseProduct(jacobian.transpose() * residuals);
  const Eigen::MatrixXd curvature = size.asDiagonal() * (jacobian.transpose() * jacobian) * size.asDiagonal();
  return gradient.dot(curvature.completeOrthogonalDecomposition().solve(gradient));
}

void LinearModel::move_to(const Eigen::VectorXd& to, const Eigen::VectorXd& residuals_there) {
  const Eigen::VectorXd step = to - q;
  const Eigen::VectorXd expected = jacobian * step;
  const Eigen::VectorXd weighted = step.cwiseProduct(jacobian.colwise().squaredNorm().transpose());
  const double size = step.dot(weighted);
  if (size > 0.0) jacobian += (residuals_there - residuals - expected) * (weighted / size).transpose();
  kept_over_sigmas += expected.norm();
  q = to;
  residuals = residuals_there;
}

void move_to_minimum(LinearModel& model, const ParameterSpace& space, std::vector<bool> is_free) {
  for (bool is_stopped = true; is_stopped;) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < space.size(); ++i)
      if (is_free[static_cast<size_t>(i)]) free.push_back(i);
    if (free.empty()) return;
    const Eigen::MatrixXd columns = model.jacobian(Eigen::all, free);
    Eigen::VectorXd wanted = model.q;
    wanted(free) -= columns.colPivHouseholderQr().solve(model.residuals);
    const Eigen::VectorXd within = space.clamped(wanted);
    is_stopped = within != wanted;
    // Where a bound stops some of them they alone go there, and the others are sought anew beside them.
    Eigen::VectorXd to = is_stopped ? model.q : wanted;
    for (const Eigen::Index i : free) {
      if (within[i] == wanted[i]) continue;
      to[i] = within[i];
      is_free[static_cast<size_t>(i)] = false;
    }
    model.residuals += columns * (to - model.q)(free);
    model.q = to;
  }
}

std::vector<bool> pressed_on_bounds(const LinearModel& model, const ParameterSpace& space) {
  const Eigen::VectorXd gradient = model.jacobian.transpose() * model.residuals;
  std::vector<bool> pressed;
  for (Eigen::Index i = 0; i < space.size(); ++i) {
    const BoundSide side = space.bound_under(model.q, i);
    pressed.push_back((side == BoundSide::lower && gradient[i] > 0) ||
                      (side == BoundSide::upper && gradient[i] < 0));
  }
  return pressed;
}

}  // namespace diastole::inference
