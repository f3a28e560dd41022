#include "estimator/fit/profile.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/fit/optimiser.hpp"
#include "estimator/fit/uncertainty.hpp"

namespace diastole {
namespace {

constexpr int most_tries = 8;
constexpr double settled = 0.01;  // of the signed root of the likelihood ratio, which ends at 1.96

/// Root of the likelihood ratio with the unknown held `away` from its best value; nothing where the search fails.
std::optional<double> ratio_root(const ProfileProblem& at, Eigen::Index which, double away) {
  Eigen::VectorXd start = at.best + at.covariance.col(which) * (away / at.covariance(which, which));
  for (Eigen::Index i = 0; i < start.size(); ++i)
    start[i] = std::clamp(start[i], at.problem.lower(i), at.problem.upper(i));
  start[which] = at.best[which] + away;
  OptimiserOptions options;
  options.held = which;
  options.interrupted = at.interrupted;
  options.cost_tolerance = std::max(1e-9, 1e-3 / at.cost);
  const OptimiserResult found = minimise(at.problem, start, options);
  const Eigen::VectorXd* residuals = at.problem.residuals(found.q);
  if (!found.converged || residuals == nullptr) return {};
  return std::sqrt(std::max(0.0, residuals->squaredNorm() - 2 * at.cost));
}

ProfileEnd profile_end(const ProfileProblem& at, Eigen::Index which, double direction) {
  const double bound = direction > 0 ? at.problem.upper(which) : at.problem.lower(which);
  const double farthest = std::abs(bound - at.best[which]);
  std::vector<std::array<double, 2>> tried;
  const auto root_at = [&](double distance) {
    const std::optional<double> root = ratio_root(at, which, direction * distance);
    if (root) tried.push_back({at.best[which] + direction * distance, 0.5 * *root * *root});
    return root;
  };
  const auto end = [&](double distance, bool at_bound) {
    (void)root_at(0.5 * distance);
    return ProfileEnd{at_bound ? bound : at.best[which] + direction * distance, at_bound, true,
                      std::move(tried)};
  };
  double inner = 0, inner_root = 0;
  double away = normal_95 * std::sqrt(at.covariance(which, which));
  for (int attempt = 0; attempt < most_tries && !(at.interrupted && at.interrupted()); ++attempt) {
    away = std::min(away, farthest);
    const std::optional<double> root = root_at(away);
    if (!root) {
      away = 0.5 * (inner + away);
      continue;
    }
    if (std::abs(*root - normal_95) < settled) return end(away, false);
    if (*root < normal_95 && away >= farthest) return end(away, true);
    // The root is nearly proportional to the distance: a line through the last two points.
    const double slope = away > inner ? (*root - inner_root) / (away - inner) : *root / away;
    const double next = away + (normal_95 - *root) / std::max(slope, 1e-12);
    if (*root < normal_95) inner = away, inner_root = *root;
    away = std::clamp(next, 0.3 * away, 3 * away);
  }
  return {at.best[which] + direction * away, false, false, std::move(tried)};
}

}  // namespace

std::array<ProfileEnd, 2> profile_interval(const ProfileProblem& at, Eigen::Index which) {
  return {profile_end(at, which, -1), profile_end(at, which, +1)};
}

}  // namespace diastole
