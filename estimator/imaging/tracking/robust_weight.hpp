#pragma once
// What a pixel counts in a fit of the tag's model (Huber 1964): fully up to a few sds of the noise, beyond by the inverse of how far it is off.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "protocol/signal/median.hpp"

namespace diastole::imaging {

inline constexpr double huber_limit =
    3.0;  ///< sds, beyond which a pixel shows something other than the model
inline double huber_weight(double residual, double sigma) {
  return std::min(1.0, huber_limit * sigma / std::max(std::abs(residual), 1e-300));
}
/// The noise's standard deviation by the residuals' median size; 0 of none.
inline double robust_sigma(const std::vector<double>& residuals) {
  std::vector<double> sizes;
  for (const double residual : residuals)
    sizes.push_back(std::abs(residual));
  return sizes.empty() ? 0 : signal::deviation_of_normal(std::move(sizes));
}

}  // namespace diastole::imaging
