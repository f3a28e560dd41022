#pragma once
// What a finite-difference check of the discrete equations needs.

#include <random>
#include <vector>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {

/// The assembled tangent, stored as one triangle, times a vector.
inline std::vector<double> tangent_times(const ElasticSystem& system, const ElasticState& state,
                                         const std::vector<double>& x) {
  const std::vector<double> values = system.tangent(state);
  std::vector<double> product(x.size(), 0.0);
  for (size_t n = 0; n < values.size(); ++n) {
    const size_t row = static_cast<size_t>(system.equations().rows()[n] - 1);
    const size_t column = static_cast<size_t>(system.equations().columns()[n] - 1);
    product[row] += values[n] * x[column];
    if (row != column) product[column] += values[n] * x[row];
  }
  return product;
}

inline std::vector<double> random_step(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> step(count);
  for (double& value : step)
    value = unit(random);
  return step;
}

}  // namespace diastole
