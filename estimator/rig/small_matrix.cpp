#include "estimator/rig/small_matrix.hpp"

#include <array>

// g++ builds the loop for processors with wide registers besides; clang's sanitizers cannot start such choices.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define DIASTOLE_WIDE_TOO __attribute__((target_clones("arch=haswell", "default")))
#else
#define DIASTOLE_WIDE_TOO
#endif

namespace diastole::rig {
namespace {

template <size_t Rows>
[[gnu::always_inline]] inline void multiply_rows(const double* values, size_t stride, size_t columns,
                                                 const double* in, double* out, bool add) {
  std::array<double, Rows> sum{};
  if (add) {
    for (size_t i = 0; i < Rows; ++i)
      sum[i] = out[i];
  }
  for (size_t j = 0; j < columns; ++j) {
    for (size_t i = 0; i < Rows; ++i)
      sum[i] += values[j * stride + i] * in[j];
  }
  for (size_t i = 0; i < Rows; ++i)
    out[i] = sum[i];
}

DIASTOLE_WIDE_TOO void multiply_all(const double* values, size_t rows, size_t columns, const double* in,
                                    double* out, bool add) {
  size_t row = 0;
  for (; row + 8 <= rows; row += 8)
    multiply_rows<8>(values + row, rows, columns, in, out + row, add);
  if (row < rows) multiply_rows<4>(values + row, rows, columns, in, out + row, add);
}

}  // namespace

SmallMatrix::SmallMatrix(const Eigen::MatrixXd& matrix) {
  values_.setZero(padded(matrix.rows()), matrix.cols());
  values_.topRows(matrix.rows()) = matrix;
}

void SmallMatrix::multiply(const double* in, double* out, bool add) const {
  multiply_all(values_.data(), static_cast<size_t>(values_.rows()), static_cast<size_t>(values_.cols()), in,
               out, add);
}

}  // namespace diastole::rig
