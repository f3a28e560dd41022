#include "estimator/rig/small_matrix.hpp"

#include <cstring>

namespace diastole::rig {
namespace {

/// Neighbouring rows as one value: compilers arrange loops over an array's elements several times worse.
template <size_t Rows>
struct Neighbours {
  using Type __attribute__((vector_size(Rows * sizeof(double)))) = double;
};

/// Count * Width rows side by side, so that their sums do not wait for each other.
template <size_t Width, size_t Count>
[[gnu::always_inline]] inline void multiply_rows(const double* values, size_t stride, size_t columns,
                                                 const double* in, double* out, bool add) {
  using Rows = typename Neighbours<Width>::Type;
  Rows sum[Count] = {};  // NOLINT: no call must stand between the loops and the registers
  if (add) std::memcpy(sum, out, sizeof sum);
  for (size_t j = 0; j < columns; ++j) {
    for (size_t i = 0; i < Count; ++i) {
      Rows column;
      std::memcpy(&column, values + j * stride + Width * i, sizeof column);
      sum[i] += column * in[j];
    }
  }
  std::memcpy(out, sum, sizeof sum);
}

template <size_t Width>
[[gnu::always_inline]] inline void multiply_all(const double* values, size_t rows, size_t columns,
                                                const double* in, double* out, bool add) {
  size_t row = 0;
  for (; row + 32 <= rows; row += 32)
    multiply_rows<Width, 32 / Width>(values + row, rows, columns, in, out + row, add);
  for (; row + 16 <= rows; row += 16)
    multiply_rows<Width, 16 / Width>(values + row, rows, columns, in, out + row, add);
  for (; row < rows; row += 8)
    multiply_rows<Width, 8 / Width>(values + row, rows, columns, in, out + row, add);
}

using Multiply = void (*)(const double*, size_t, size_t, const double*, double*, bool);

void multiply_narrow(const double* values, size_t rows, size_t columns, const double* in, double* out,
                     bool add) {
  multiply_all<2>(values, rows, columns, in, out, add);
}

#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] void multiply_wide(const double* values, size_t rows, size_t columns,
                                               const double* in, double* out, bool add) {
  multiply_all<4>(values, rows, columns, in, out, add);
}

[[gnu::target("avx512f")]] void multiply_widest(const double* values, size_t rows, size_t columns,
                                                const double* in, double* out, bool add) {
  multiply_all<8>(values, rows, columns, in, out, add);
}

/// For this processor.
Multiply best() {
  if (__builtin_cpu_supports("avx512f")) return multiply_widest;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return multiply_wide;
  return multiply_narrow;
}
#else
Multiply best() { return multiply_narrow; }
#endif

}  // namespace

SmallMatrix::SmallMatrix(const Eigen::MatrixXd& matrix) {
  values_.setZero(padded(matrix.rows()), matrix.cols());
  values_.topRows(matrix.rows()) = matrix;
}

void SmallMatrix::multiply(const double* in, double* out, bool add) const {
  static const Multiply product = best();
  product(values_.data(), static_cast<size_t>(values_.rows()), static_cast<size_t>(values_.cols()), in, out,
          add);
}

}  // namespace diastole::rig
