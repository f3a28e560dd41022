#include "estimator/rig/small_matrix.hpp"

#include <cstring>
#include <utility>

namespace diastole::rig {
namespace {

/// Neighbouring rows as one value: compilers arrange loops over an array's elements several times worse.
template <size_t Rows>
struct Neighbours {
  using Type __attribute__((vector_size(Rows * sizeof(double)))) = double;
};

template <class Rows>
[[gnu::always_inline]] inline void add_column(Rows& sum, const double* column, double by) {
  Rows rows;
  std::memcpy(&rows, column, sizeof rows);
  sum += rows * by;
}

/// As many times Width rows as there are `Part`, side by side and odd columns apart, so that sums do not wait for each other. All
/// places are constants: the sums stay in registers.
template <size_t Width, size_t... Part>
[[gnu::always_inline]] inline void multiply_rows(const double* values, size_t stride, size_t columns,
                                                 const double* in, double* out, bool add,
                                                 std::index_sequence<Part...> /*parts*/) {
  using Rows = typename Neighbours<Width>::Type;
  Rows even[sizeof...(Part)] = {},
       odd[sizeof...(Part)] = {};  // NOLINT: no call must stand between them and the registers
  if (add) (std::memcpy(&even[Part], out + Width * Part, sizeof(Rows)), ...);
  size_t j = 0;
  for (; j + 2 <= columns; j += 2, values += 2 * stride) {
    (add_column(even[Part], values + Width * Part, in[j]), ...);
    (add_column(odd[Part], values + stride + Width * Part, in[j + 1]), ...);
  }
  if (j < columns) (add_column(even[Part], values + Width * Part, in[j]), ...);
  ((even[Part] += odd[Part]), ...);
  (std::memcpy(out + Width * Part, &even[Part], sizeof(Rows)), ...);
}

template <size_t Width>
[[gnu::always_inline]] inline void multiply_all(const double* values, size_t rows, size_t columns,
                                                const double* in, double* out, bool add) {
  constexpr std::make_index_sequence<8 / Width> eight;
  constexpr std::make_index_sequence<16 / Width> sixteen;
  size_t row = 0;
  for (; row + 16 <= rows; row += 16)
    multiply_rows<Width>(values + row, rows, columns, in, out + row, add, sixteen);
  if (row < rows) multiply_rows<Width>(values + row, rows, columns, in, out + row, add, eight);
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
