#pragma once
// The value that a share of some values do not exceed: of two neighbours the lower one.

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace diastole::signal {

/// The place among `count` sorted values. `share` in [0, 1]. Precondition: count > 0.
inline size_t place_of_quantile(size_t count, double share) {
  return static_cast<size_t>(share * static_cast<double>(count - 1));
}

/// 0 of none. `share` in [0, 1]. Precondition: no NaN.
template <class Value>
Value quantile(std::vector<Value> values, double share) {
  if (values.empty()) return Value{};
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place_of_quantile(values.size(), share));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Of values in ascending order. Precondition: not empty.
inline double quantile_of_sorted(std::span<const double> values, double share) {
  return values[place_of_quantile(values.size(), share)];
}

}  // namespace diastole::signal
