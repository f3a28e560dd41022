// Gel with one family of fibres: an isotropic matrix that may stiffen, and fibres that resist any change of length,
//
//   W = C1/beta (exp(beta (I1 - 3)) - 1) + k1/(2 k2) (exp(k2 (I4 - 1)^2) - 1),       I4 = C_ff
//
// beta = 0 is a neo-Hookean matrix, k2 = 0 fibres of energy k1/2 (I4 - 1)^2, k1 = 0 no fibres.
//
// Matrix: H. Demiray, J. Biomech. 5 (1972) 309-311; fibres: G. A. Holzapfel, T. C. Gasser, R. W. Ogden, J. Elast. 61
// (2000) 1-48, here embedded in a solid that lets them bear compression too.

#include <array>
#include <cmath>
#include <string_view>

#include "estimator/materials/energy_law.hpp"

namespace diastole {
namespace {

struct FibreReinforced {
  static constexpr std::string_view name = "fibre-reinforced";
  static constexpr bool needs_axes = true;
  static constexpr std::array<LawParameter, 4> parameters{
      {{"C1_kPa", "half the shear modulus of the matrix at rest", 0.0, 8.71, "kPa"},
       {"beta", "stiffening of the matrix with I1 - 3; 0 is neo-Hookean", -1.0, 2.0},
       {"k1_kPa", "fibres: stress for I4 - 1", -1.0, 3.0, "kPa"},
       {"k2", "stiffening of the fibres with (I4 - 1)^2", -1.0, 5.0}}};

  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 4>& values) {
    const auto& [C1, beta, k1, k2] = values;
    const Scalar stretch = c[0] - constant<Scalar>(1.0);
    return C1 * exponential_rise<Scalar>(trace(c) - constant<Scalar>(3.0), beta) +
           constant<Scalar>(0.5) * k1 * exponential_rise<Scalar>(stretch * stretch, k2);
  }

  static SymmetricTensor<double> stress(const SymmetricTensor<double>& c, std::span<const double> values) {
    const double matrix = 2.0 * values[0] * std::exp(values[1] * (trace(c) - 3.0));
    const double stretch = c[0] - 1.0;
    const double fibre = 2.0 * values[2] * stretch * std::exp(values[3] * stretch * stretch);
    return {matrix + fibre, matrix, matrix, 0.0, 0.0, 0.0};
  }

  static MaterialResponse response(const SymmetricTensor<double>& c, std::span<const double> values) {
    MaterialResponse result{stress(c, values), TangentTensor::Zero()};
    result.tangent.topLeftCorner<3, 3>().setConstant(2.0 * values[1] * result.stress[1]);
    const double square = (c[0] - 1.0) * (c[0] - 1.0);
    result.tangent(0, 0) += 4.0 * values[2] * std::exp(values[3] * square) * (1.0 + 2.0 * values[3] * square);
    return result;
  }
};

}  // namespace

const Law& fibre_reinforced_law() { return law_of<FibreReinforced>(); }

}  // namespace diastole
