#include "estimator/mesh/hermite_basis.hpp"

namespace diastole {

HermiteBasis hermite_basis(const Xi& xi) {
  std::array<std::array<double, 4>, 3> h;
  std::array<std::array<double, 4>, 3> dh;
  for (size_t k = 0; k < 3; ++k) {
    h[k] = hermite_values(xi[k]);
    dh[k] = hermite_slopes(xi[k]);
  }
  HermiteBasis basis;
  for (size_t a = 0; a < hermite_functions; ++a) {
    const size_t a1 = a & 3;
    const size_t a2 = (a >> 2) & 3;
    const size_t a3 = a >> 4;
    basis.value[a] = h[0][a1] * h[1][a2] * h[2][a3];
    basis.slope[0][a] = dh[0][a1] * h[1][a2] * h[2][a3];
    basis.slope[1][a] = h[0][a1] * dh[1][a2] * h[2][a3];
    basis.slope[2][a] = h[0][a1] * h[1][a2] * dh[2][a3];
  }
  return basis;
}

std::array<double, corners> trilinear_basis(const Xi& xi) {
  std::array<double, corners> basis;
  for (size_t c = 0; c < corners; ++c) {
    double product = 1.0;
    for (size_t k = 0; k < 3; ++k)
      product *= ((c >> k) & 1) != 0 ? xi[k] : 1.0 - xi[k];
    basis[c] = product;
  }
  return basis;
}

}  // namespace diastole
