#pragma once
// What a pixel counts in a fit of the tag's model (Huber 1964): fully up to a few sds of the noise, beyond by the inverse of how far it is off.

#include <algorithm>
#include <cmath>

namespace diastole::imaging {

inline constexpr double huber_limit =
    3.0;  ///< sds, beyond which a pixel shows something other than the model
inline double huber_weight(double residual, double sigma) {
  return std::min(1.0, huber_limit * sigma / std::max(std::abs(residual), 1e-300));
}

}  // namespace diastole::imaging
