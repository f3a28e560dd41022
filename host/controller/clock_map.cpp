#include "host/controller/clock_map.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "protocol/signal/median.hpp"

namespace diastole {
namespace {

using signal::median;

constexpr size_t most_pairs_for_slopes = 200;
constexpr double rejection_in_deviations = 4.5;
constexpr double least_span_s = 1.0;
constexpr double largest_drift = 1e-2;  // crystals differ by 1e-4 at most; more is not a drift
constexpr double least_uncertainty_s = 1e-6;

/// Median slope between pairs that lie at least half the span apart.
double median_slope(const std::vector<ClockPair>& pairs, double span_s) {
  const size_t stride = 1 + pairs.size() / most_pairs_for_slopes;
  std::vector<double> slopes;
  for (size_t i = 0; i < pairs.size(); i += stride) {
    for (size_t j = i + stride; j < pairs.size(); j += stride) {
      const double apart_s = pairs[j].host_s - pairs[i].host_s;
      if (apart_s >= 0.5 * span_s) slopes.push_back((pairs[j].other_s - pairs[i].other_s) / apart_s);
    }
  }
  return slopes.empty() ? 1.0 : median(std::move(slopes));
}

std::vector<double> residuals(const std::vector<ClockPair>& pairs, const ClockMap& map) {
  std::vector<double> values;
  for (const ClockPair& pair : pairs)
    values.push_back(pair.other_s - map.to_other_s(pair.host_s));
  return values;
}

/// Shifts the map by the median residual, and returns the pairs that then lie close to it.
std::vector<ClockPair> centre_and_select(const std::vector<ClockPair>& pairs, ClockMap& map) {
  map.other_ref_s += median(residuals(pairs, map));
  std::vector<double> sizes = residuals(pairs, map);
  for (double& size : sizes)
    size = std::abs(size);
  const double bound_s =
      std::max(least_uncertainty_s, rejection_in_deviations * signal::deviation_of_normal(sizes));
  std::vector<ClockPair> kept;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (sizes[i] <= bound_s) kept.push_back(pairs[i]);
  }
  return kept;
}

/// Weighted least squares; the slope is left as it is if `fix_scale`.
void refine(const std::vector<ClockPair>& pairs, bool fix_scale, ClockMap& map) {
  double weight = 0, host = 0, other = 0;
  const auto weight_of = [](const ClockPair& pair) {
    const double u = std::max(pair.uncertainty_s, least_uncertainty_s);
    return 1 / (u * u);
  };
  for (const ClockPair& pair : pairs) {
    const double w = weight_of(pair);
    weight += w;
    host += w * (pair.host_s - map.host_ref_s);
    other += w * (pair.other_s - map.other_ref_s);
  }
  host /= weight;
  other /= weight;
  double squares = 0, products = 0;
  for (const ClockPair& pair : pairs) {
    const double h = pair.host_s - map.host_ref_s - host;
    squares += weight_of(pair) * h * h;
    products += weight_of(pair) * h * (pair.other_s - map.other_ref_s - other);
  }
  map.host_ref_s += host;
  map.other_ref_s += other;
  if (!fix_scale && squares > 0) map.scale = products / squares;
  double sum = 0;
  for (const double residual_s : residuals(pairs, map))
    sum += residual_s * residual_s;
  map.residual_s = std::sqrt(sum / static_cast<double>(pairs.size()));
}

}  // namespace

std::optional<ClockMap> fit_clock_map(std::span<const ClockPair> all) {
  if (all.empty()) return std::nullopt;
  const std::vector<ClockPair> pairs(all.begin(), all.end());
  const auto [first, last] = std::minmax_element(
      pairs.begin(), pairs.end(), [](const ClockPair& a, const ClockPair& b) { return a.host_s < b.host_s; });
  const double span_s = last->host_s - first->host_s;
  ClockMap map{.host_ref_s = first->host_s, .other_ref_s = first->other_s};
  bool fix_scale = pairs.size() < 3 || span_s < least_span_s;
  if (!fix_scale) map.scale = median_slope(pairs, span_s);
  if (std::abs(map.scale - 1) > largest_drift) {
    fix_scale = true;
    map.scale = 1;
  }
  const std::vector<ClockPair> kept = centre_and_select(pairs, map);
  refine(kept, fix_scale, map);
  map.pairs_dropped = pairs.size() - kept.size();
  return map;
}

}  // namespace diastole
