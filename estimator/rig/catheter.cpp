#include "estimator/rig/catheter.hpp"

#include <Eigen/Dense>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

namespace diastole::rig {

std::vector<double> through_catheter(const Catheter& catheter, std::span<const double> pressure_kPa,
                                     double step_s) {
  const double omega = 2.0 * std::numbers::pi * catheter.resonance_Hz;
  Eigen::Matrix4d grown = Eigen::Matrix4d::Zero();
  grown(0, 1) = step_s;
  grown(1, 0) = -omega * omega * step_s;
  grown(1, 1) = -2.0 * catheter.damping * omega * step_s;
  grown(1, 2) = omega * omega * step_s;
  grown(2, 3) = 1.0;
  const Eigen::Matrix4d exponential = grown.exp();
  const Eigen::Matrix2d flow = exponential.topLeftCorner<2, 2>();
  const Eigen::Vector2d from_end = exponential.block<2, 1>(0, 3);
  const Eigen::Vector2d from_start = exponential.block<2, 1>(0, 2) - from_end;

  std::vector<double> shown(pressure_kPa.size());
  Eigen::Vector2d state(pressure_kPa.empty() ? 0.0 : pressure_kPa.front(), 0.0);
  for (size_t k = 0; k < pressure_kPa.size(); ++k) {
    if (k > 0) state = flow * state + from_start * pressure_kPa[k - 1] + from_end * pressure_kPa[k];
    shown[k] = state[0];
  }
  return shown;
}

}  // namespace diastole::rig
