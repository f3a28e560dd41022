#include "estimator/rig/gauss_legendre.hpp"

#include <cmath>
#include <numbers>

namespace diastole::rig {

GaussLegendre::GaussLegendre(size_t points) {
  const double n = static_cast<double>(points);
  for (size_t k = 0; k < points; ++k) {
    double x = std::cos(std::numbers::pi * (static_cast<double>(k) + 0.75) / (n + 0.5));
    double slope = 0.0;
    for (int newton = 0; newton < 8; ++newton) {
      double value = 1.0;
      double before = 0.0;
      for (size_t j = 1; j <= points; ++j) {
        const double degree = static_cast<double>(j);
        const double next = ((2.0 * degree - 1.0) * x * value - (degree - 1.0) * before) / degree;
        before = value;
        value = next;
      }
      slope = n * (x * value - before) / (x * x - 1.0);
      x -= value / slope;
    }
    place.push_back(0.5 * (1.0 + x));
    weight.push_back(1.0 / ((1.0 - x * x) * slope * slope));
  }
}

}  // namespace diastole::rig
