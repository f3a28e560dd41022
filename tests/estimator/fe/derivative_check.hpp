#pragma once
// What a finite-difference check of the discrete equations needs.

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {

inline std::vector<double> random_step(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> step(count);
  for (double& value : step)
    value = unit(random);
  return step;
}

/// The assembled tangent, stored as one triangle and the free rims' skew part, times a vector.
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
  const std::vector<double> skew = system.skew_tangent(state);
  for (size_t n = 0; n < skew.size(); ++n) {
    const size_t row = static_cast<size_t>(system.rim_skew().rows()[n]);
    const size_t column = static_cast<size_t>(system.rim_skew().columns()[n]);
    product[row] += skew[n] * x[column];
    product[column] -= skew[n] * x[row];
  }
  return product;
}

/// Largest difference between the tangent times some random steps and central differences of the residual, relative
/// to the largest of the latter.
inline double tangent_fault(const ElasticSystem& system, const ElasticState& state) {
  double worst = 0.0;
  for (unsigned seed = 1; seed < 4; ++seed) {
    const std::vector<double> step =
        random_step(system.equations().unknowns(state.held_volume_mm3.has_value()), seed);
    constexpr double h = 1e-5;
    const std::vector<double> low = system.residual(system.moved(state, step, -h)).values;
    const std::vector<double> high = system.residual(system.moved(state, step, h)).values;
    const std::vector<double> product = tangent_times(system, state, step);
    double difference = 0.0;
    double scale = 0.0;
    for (size_t i = 0; i < high.size(); ++i) {
      const double slope = (high[i] - low[i]) / (2 * h);
      difference = std::max(difference, std::abs(product[i] - slope));
      scale = std::max(scale, std::abs(slope));
    }
    worst = std::max(worst, difference / scale);
  }
  return worst;
}

/// How far the cavity wall's area vectors are from the derivative of its volume along a random step, relative to it.
inline double area_fault(const ElasticSystem& system, const ElasticState& state) {
  const std::vector<double> area = system.cavity_area(state);
  const std::vector<double> step = random_step(area.size(), 4);
  constexpr double h = 1e-4;
  const double slope = (system.cavity_volume_mm3(system.moved(state, step, h)) -
                        system.cavity_volume_mm3(system.moved(state, step, -h))) /
                       (2 * h);
  double along = 0.0;
  for (size_t i = 0; i < step.size(); ++i)
    along += area[i] * step[i];
  return std::abs(along / slope - 1.0);
}

}  // namespace diastole
