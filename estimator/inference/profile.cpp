#include "estimator/inference/profile.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/inference/intervals.hpp"

namespace diastole::inference {
namespace {

constexpr int most_tries = 8;
constexpr double settled = 0.01;  // of the signed root of the likelihood ratio, which ends at 1.96

/// Root of the likelihood ratio with the unknown held `away` from its best value; nothing where the search fails.
std::optional<double> ratio_root(const ProfiledOptimum& at, Eigen::Index which, double away) {
  Eigen::VectorXd start = at.best + at.covariance.col(which) * (away / at.covariance(which, which));
  start[which] = at.best[which] + away;
  SearchOptions options;
  options.held.assign(static_cast<size_t>(start.size()), false);
  options.held[static_cast<size_t>(which)] = true;
  options.interrupted = at.interrupted;
  options.cost_tolerance = std::max(1e-9, 1e-3 / at.cost);
  const SearchResult found = minimise(at.problem, start, options);
  if (!is_settled(found.termination)) return {};
  return std::sqrt(std::max(0.0, 2 * (found.cost() - at.cost)));
}

ProfileEnd profile_end(const ProfiledOptimum& at, Eigen::Index which, double direction) {
  const ParameterSpace& space = at.problem.space();
  const double bound = direction > 0 ? space.upper()[which] : space.lower()[which];
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

std::array<ProfileEnd, 2> profile_interval(const ProfiledOptimum& at, Eigen::Index which) {
  return {profile_end(at, which, -1), profile_end(at, which, +1)};
}

}  // namespace diastole::inference
