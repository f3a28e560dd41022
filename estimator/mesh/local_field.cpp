#include "estimator/mesh/local_field.hpp"

#include <array>

namespace diastole {
namespace {

using Line = std::array<double, 4>;

/// Sum of four blocks of Count numbers, each with its factor.
template <size_t Count>
std::array<double, Count> combined(const Line& factor, const double* blocks) {
  std::array<double, Count> sum;
  for (size_t n = 0; n < Count; ++n) {
    sum[n] = factor[0] * blocks[n] + factor[1] * blocks[Count + n] + factor[2] * blocks[2 * Count + n] +
             factor[3] * blocks[3 * Count + n];
  }
  return sum;
}

constexpr size_t layer_numbers = 48;  // [along xi2][along xi1][component]
constexpr size_t row_numbers = 12;    // [along xi1][component]

Eigen::Vector3d vector_of(const std::array<double, 3>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

}  // namespace

LocalField local_field(const ElementField& coefficients, const Xi& xi) {
  const Line h1 = hermite_values(xi[0]), h2 = hermite_values(xi[1]), h3 = hermite_values(xi[2]);
  const auto layer_values = combined<layer_numbers>(h3, coefficients.data());
  const auto layer_slopes = combined<layer_numbers>(hermite_slopes(xi[2]), coefficients.data());
  const auto row_values = combined<row_numbers>(h2, layer_values.data());
  LocalField local;
  local.value = vector_of(combined<3>(h1, row_values.data()));
  local.slope.col(0) = vector_of(combined<3>(hermite_slopes(xi[0]), row_values.data()));
  local.slope.col(1) =
      vector_of(combined<3>(h1, combined<row_numbers>(hermite_slopes(xi[1]), layer_values.data()).data()));
  local.slope.col(2) = vector_of(combined<3>(h1, combined<row_numbers>(h2, layer_slopes.data()).data()));
  return local;
}

Eigen::Vector3d local_value(const ElementField& coefficients, const Xi& xi) {
  const auto of_layer = combined<layer_numbers>(hermite_values(xi[2]), coefficients.data());
  const auto of_row = combined<row_numbers>(hermite_values(xi[1]), of_layer.data());
  return vector_of(combined<3>(hermite_values(xi[0]), of_row.data()));
}

std::array<double, hermite_functions> hermite_basis_values(const Xi& xi) {
  const Line h1 = hermite_values(xi[0]), h2 = hermite_values(xi[1]), h3 = hermite_values(xi[2]);
  std::array<double, hermite_functions> values;
  for (size_t a = 0; a < hermite_functions; ++a)
    values[a] = h1[a & 3] * h2[(a >> 2) & 3] * h3[a >> 4];
  return values;
}

std::vector<ElementField> element_fields(const HermiteMesh& mesh, std::span<const double> field) {
  std::vector<ElementField> fields;
  fields.reserve(mesh.element_count());
  for (size_t e = 0; e < mesh.element_count(); ++e)
    fields.push_back(mesh.gather(e, field));
  return fields;
}

}  // namespace diastole
