#include "estimator/reconstruction/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace diastole {
namespace {

constexpr double lowest_exponent = 0, highest_exponent = 8;
constexpr double golden = 0.6180339887498949;

}  // namespace

Eigen::MatrixXd random_signs(Eigen::Index rows) {
  constexpr Eigen::Index probes = 24;
  std::mt19937_64 random(20050131);
  Eigen::MatrixXd signs(rows, probes);
  for (Eigen::Index column = 0; column < probes; ++column) {
    for (Eigen::Index row = 0; row < rows; ++row)
      signs(row, column) = (random() >> 63) != 0 ? 1.0 : -1.0;
  }
  return signs;
}

Eigen::MatrixXd seen_signs(const SmoothedSystem& system) {
  return system.weighted_rows().transpose() * random_signs(system.weighted_rows().rows());
}

double stochastic_trace(const SmoothedSystem& system, const Eigen::MatrixXd& right_sides) {
  return right_sides.cwiseProduct(system.solve(right_sides)).sum() / static_cast<double>(right_sides.cols());
}

Eigen::VectorXd residual_shares(const SmoothedSystem& system, const Eigen::MatrixXd& signs) {
  const Eigen::MatrixXd right_sides = system.weighted_rows().transpose() * signs;
  const Eigen::MatrixXd left = signs - system.weighted_rows() * system.solve(right_sides);
  return left.rowwise().squaredNorm() / static_cast<double>(signs.cols());
}

CrossValidation choose_lambda(SmoothedSystem& system, double fineness) {
  const Eigen::MatrixXd right_sides = seen_signs(system);
  const auto measured = static_cast<double>(system.measured());
  CrossValidation result;
  const auto score = [&](double exponent) {
    system.factorise(std::pow(10.0, exponent));
    const Eigen::VectorXd misfit = system.weighted_rows() * system.solution() - system.weighted_targets();
    const double trace = stochastic_trace(system, right_sides);
    // What neither data nor so little smoothness hold has no solution.
    if (!std::isfinite(misfit.squaredNorm()) || !std::isfinite(trace))
      return std::numeric_limits<double>::infinity();
    const double freedom = std::max(measured - trace, 1e-3 * measured);
    result.curve.push_back({system.lambda(), measured * misfit.squaredNorm() / (freedom * freedom), trace});
    return result.curve.back().score;
  };
  double best = lowest_exponent, least = score(lowest_exponent);
  for (double exponent = lowest_exponent + 1; exponent <= highest_exponent; ++exponent) {
    const double value = score(exponent);
    if (value < least) {
      least = value;
      best = exponent;
    }
  }
  double low = std::max(lowest_exponent, best - 1), high = std::min(highest_exponent, best + 1);
  result.at_edge = best == lowest_exponent || best == highest_exponent;
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double score_left = score(left), score_right = score(right);
  while (high - low > fineness) {
    if (score_left < score_right) {
      high = right;
      right = left;
      score_right = score_left;
      left = high - golden * (high - low);
      score_left = score(left);
    } else {
      low = left;
      left = right;
      score_left = score_right;
      right = low + golden * (high - low);
      score_right = score(right);
    }
  }
  std::sort(result.curve.begin(), result.curve.end(),
            [](const auto& a, const auto& b) { return a.lambda < b.lambda; });
  result.lambda =
      std::min_element(result.curve.begin(), result.curve.end(), [](const auto& a, const auto& b) {
        return a.score < b.score;
      })->lambda;
  system.factorise(result.lambda);
  return result;
}

}  // namespace diastole
