#pragma once
// The middle of some values: a location that single wild ones do not move.

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace diastole::signal {

/// Of an even count the upper of the two in the middle. Precondition: not empty, no NaN.
template <class Value>
Value median(std::vector<Value> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The standard deviation of normal numbers from their sizes (absolute values): 1.4826 times the median.
inline double deviation_of_normal(std::vector<double> sizes) { return 1.4826 * median(std::move(sizes)); }

}  // namespace diastole::signal
