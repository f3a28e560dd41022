#pragma once
// The value that a share of some values do not exceed.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace diastole::signal {

/// Of two neighbours the lower one; 0 of none. `share` in [0, 1]. Precondition: no NaN.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace diastole::signal
