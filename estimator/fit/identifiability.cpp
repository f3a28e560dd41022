#include "estimator/fit/identifiability.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace diastole {
namespace {

constexpr double telling_correlation = 0.8;
constexpr size_t most_pairs = 6;
constexpr double small_share = 0.1;       // of a direction: not worth a word
constexpr double unseen_relative_sd = 1;  // beyond this a value is known by its bounds only
constexpr double lopsided = 5.0;          // largest over smallest standard deviation worth telling

struct Pair {
  std::string one, other;
  double correlation;
};

bool is_whole(const FitRecord& record, const std::string& name) {
  return std::any_of(
      record.parameters.begin(), record.parameters.end(),
      [&](const FittedParameter& parameter) { return parameter.name == name && parameter.elements.empty(); });
}

std::vector<Pair> trading_pairs(const FitRecord& record) {
  const Correlation& correlation = record.correlation;
  std::vector<Pair> pairs;
  for (size_t i = 0; i < correlation.names.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (!is_whole(record, correlation.names[i]) || !is_whole(record, correlation.names[j])) continue;
      if (std::abs(correlation.matrix[i][j]) >= telling_correlation)
        pairs.push_back({correlation.names[j], correlation.names[i], correlation.matrix[i][j]});
    }
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return std::abs(a.correlation) > std::abs(b.correlation); });
  if (pairs.size() > most_pairs) pairs.resize(most_pairs);
  return pairs;
}

std::string changes(const FittedDirection& direction) {
  std::vector<std::string> parts;
  for (const auto& [name, change] : direction.change) {
    if (std::abs(change) < small_share) continue;
    parts.push_back(fmt::format("{} {} by {:.2g} %", name, change > 0 ? "up" : "down",
                                100 * direction.relative_sd * std::abs(change)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

std::vector<FittedDirection> directions_of(const FitRecord& record, const FitOutcome& fit,
                                           const std::vector<size_t>& first) {
  std::vector<std::string> names;
  std::vector<size_t> place;
  for (size_t i = 0; i < record.parameters.size(); ++i) {
    const FittedParameter& parameter = record.parameters[i];
    if (!parameter.elements.empty() || !(parameter.bounds[0] > 0) || !std::isfinite(parameter.se)) continue;
    names.push_back(parameter.name);
    place.push_back(first[i]);
  }
  const auto count = static_cast<Eigen::Index>(names.size());
  if (count < 2) return {};
  Eigen::MatrixXd relative(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const size_t a = place[static_cast<size_t>(i)], b = place[static_cast<size_t>(j)];
      relative(i, j) = fit.covariance(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) /
                       (fit.values[a].value * fit.values[b].value);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(relative);
  std::vector<FittedDirection> directions;
  for (Eigen::Index k = count; k-- > 0;) {
    Eigen::VectorXd change = solver.eigenvectors().col(k);
    Eigen::Index largest = 0;
    change.cwiseAbs().maxCoeff(&largest);
    if (change[largest] < 0) change = -change;
    FittedDirection direction{std::sqrt(std::max(0.0, solver.eigenvalues()[k])), {}};
    for (Eigen::Index i = 0; i < count; ++i)
      direction.change.emplace_back(names[static_cast<size_t>(i)], change[i]);
    directions.push_back(std::move(direction));
  }
  return directions;
}

std::vector<std::string> identifiability_remarks(const FitRecord& record) {
  std::vector<std::string> remarks;
  for (const Pair& pair : trading_pairs(record)) {
    remarks.push_back(fmt::format(
        "{} and {} trade off: the data tell {} far better than either (correlation {:+.2f}).", pair.one,
        pair.other, pair.correlation > 0 ? "their ratio" : "their product", pair.correlation));
  }
  if (record.directions.size() < 2) return remarks;
  const FittedDirection& worst = record.directions.front();
  const FittedDirection& best = record.directions.back();
  if (worst.relative_sd > unseen_relative_sd) {
    remarks.push_back(
        fmt::format("The data cannot see this combination: {}. Fix one of these parameters, or add loads "
                    "that tell them apart.",
                    changes(worst)));
  } else if (worst.relative_sd > lopsided * best.relative_sd) {
    remarks.push_back(
        fmt::format("The data see this combination worst (one standard deviation): {}; and this one best: "
                    "{}. The first is {:.0f} times less certain.",
                    changes(worst), changes(best), worst.relative_sd / best.relative_sd));
  }
  return remarks;
}

}  // namespace diastole
