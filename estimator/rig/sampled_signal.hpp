#pragma once
// Values between evenly spaced samples.

#include <algorithm>
#include <span>

namespace diastole::rig {

/// Catmull-Rom cubic through the samples around `place` (0 is the first sample); beyond the ends, the end's value.
inline double sampled(std::span<const double> values, double place) {
  const double last = static_cast<double>(values.size() - 1);
  if (place <= 0.0) return values.front();
  if (place >= last) return values.back();
  const size_t k = std::min(static_cast<size_t>(place), values.size() - 2);
  const double s = place - static_cast<double>(k);
  if (s == 0.0) return values[k];
  const double p1 = values[k];
  const double p2 = values[k + 1];
  const double p0 = k > 0 ? values[k - 1] : 2.0 * p1 - p2;
  const double p3 = k + 2 < values.size() ? values[k + 2] : 2.0 * p2 - p1;
  return p1 +
         0.5 * s * (p2 - p0 + s * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + s * (3.0 * (p1 - p2) + p3 - p0)));
}

}  // namespace diastole::rig
