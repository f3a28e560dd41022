#pragma once
// Gauss-Legendre quadrature on [0, 1]: exact for polynomials up to degree 2 n - 1.

#include <cstddef>
#include <vector>

namespace diastole::rig {

struct GaussLegendre {
  explicit GaussLegendre(size_t points);
  std::vector<double> place;
  std::vector<double> weight;  ///< their sum is one
};

}  // namespace diastole::rig
