#include "estimator/reconstruction/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

constexpr double lowest_exponent = 0, highest_exponent = 8;
constexpr double golden = 0.6180339887498949;

double trace_of(const Eigen::MatrixXd& seen_signs, const Eigen::MatrixXd& solved) {
  return seen_signs.cwiseProduct(solved).sum() / static_cast<double>(seen_signs.cols());
}

/// Its score is infinite where the field has no solution.
CrossValidationPoint point_at(const SmoothedSystem& system, double lambda, const Eigen::MatrixXd& right_sides,
                              double measured) {
  constexpr double none = std::numeric_limits<double>::infinity();
  const std::unique_ptr<const CholeskyFactor> factor = system.factor_at(lambda);
  if (!factor) return {lambda, none, 0.0};
  const Eigen::VectorXd misfit =
      system.weighted_rows() * factor->solve(system.right_side()) - system.weighted_targets();
  const double trace = trace_of(right_sides, factor->solve(right_sides));
  const double freedom = std::max(measured - trace, 1e-3 * measured);
  const double score = measured * misfit.squaredNorm() / (freedom * freedom);
  return {lambda, std::isfinite(score) && std::isfinite(trace) ? score : none, trace};
}

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
  return trace_of(right_sides, system.solve(right_sides));
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
  // Of some λ at the same time.
  const auto scores = [&](const std::vector<double>& exponents) {
    std::vector<CrossValidationPoint> points(exponents.size());
    parallel_for(points.size(), machine_threads(), [&](size_t i) {
      points[i] = point_at(system, std::pow(10.0, exponents[i]), right_sides, measured);
    });
    std::vector<double> score;
    for (const CrossValidationPoint& point : points) {
      score.push_back(point.score);
      if (std::isfinite(point.score)) result.curve.push_back(point);
    }
    return score;
  };
  std::vector<double> decades;
  for (double exponent = lowest_exponent; exponent <= highest_exponent; ++exponent)
    decades.push_back(exponent);
  const std::vector<double> coarse = scores(decades);
  const double best =
      decades[static_cast<size_t>(std::min_element(coarse.begin(), coarse.end()) - coarse.begin())];
  double low = std::max(lowest_exponent, best - 1), high = std::min(highest_exponent, best + 1);
  result.at_edge = best == lowest_exponent || best == highest_exponent;
  double left = high - golden * (high - low), right = low + golden * (high - low);
  const std::vector<double> inside = scores({left, right});
  double score_left = inside[0], score_right = inside[1];
  while (high - low > fineness) {
    if (score_left < score_right) {
      high = right;
      right = left;
      score_right = score_left;
      left = high - golden * (high - low);
      score_left = scores({left}).front();
    } else {
      low = left;
      left = right;
      score_left = score_right;
      right = low + golden * (high - low);
      score_right = scores({right}).front();
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
