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
  const std::vector<bool> may_move = is_free;
  // Each round a bound stops an unknown, or lets one go that is better off within (active set; degenerate ones might do both for ever).
  for (Eigen::Index round = 0; round < 3 * space.size() + 1; ++round) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < space.size(); ++i)
      if (is_free[static_cast<size_t>(i)]) free.push_back(i);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(space.size());
    if (!free.empty())
      step(free) =
          -Eigen::MatrixXd(model.jacobian(Eigen::all, free)).colPivHouseholderQr().solve(model.residuals);
    const Eigen::VectorXd within = space.clamped(model.q + step);
    double part = 1.0;  // of the step, up to the first bound
    Eigen::Index stopped = -1;
    for (const Eigen::Index i : free) {
      if (within[i] == model.q[i] + step[i]) continue;
      const double up_to = (within[i] - model.q[i]) / step[i];
      if (stopped < 0 || up_to < part) part = up_to, stopped = i;
    }
    model.residuals += part * (model.jacobian * step);
    model.q += part * step;
    if (stopped >= 0) {
      model.q[stopped] = within[stopped];
      is_free[static_cast<size_t>(stopped)] = false;
      continue;
    }
    const std::vector<bool> pressed = pressed_on_bounds(model, space);
    Eigen::Index released = 0;
    while (released < space.size() &&
           (!may_move[static_cast<size_t>(released)] || is_free[static_cast<size_t>(released)] ||
            pressed[static_cast<size_t>(released)]))
      ++released;
    if (released == space.size()) return;
    is_free[static_cast<size_t>(released)] = true;
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
