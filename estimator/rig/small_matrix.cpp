#include "estimator/rig/small_matrix.hpp"

#include <utility>

namespace diastole::rig {
namespace {

/// Neighbouring rows as one value: compilers arrange loops over an array's elements several times worse.
template <size_t Width>
struct Neighbours {
  using Type __attribute__((vector_size(Width * sizeof(double)))) = double;
};

// Not std::memcpy: where that is checked, sums do not stay in registers.
template <class Rows>
[[gnu::always_inline]] inline void load(Rows& rows, const double* from) {
  __builtin_memcpy(&rows, from, sizeof rows);
}

template <class Rows>
[[gnu::always_inline]] inline void add_column(Rows& sum, const double* column, double by) {
  Rows rows;
  load(rows, column);
  sum += rows * by;
}

/// As many times Width rows as there are `Part`, side by side and odd columns apart, so that sums do not wait for each other. All
/// places are constants: the sums stay in registers.
template <size_t Width, size_t... Part>
[[gnu::always_inline]] inline void multiply_rows(const double* values, size_t stride, size_t columns,
                                                 const double* before, const double* in, double* out,
                                                 std::index_sequence<Part...> /*parts*/) {
  using Rows = typename Neighbours<Width>::Type;
  Rows even[sizeof...(Part)] = {},
       odd[sizeof...(Part)] = {};  // NOLINT: no call must stand between them and the registers
  if (before != nullptr) (load(even[Part], before + Width * Part), ...);
  size_t j = 0;
  for (; j + 2 <= columns; j += 2, values += 2 * stride) {
    (add_column(even[Part], values + Width * Part, in[j]), ...);
    (add_column(odd[Part], values + stride + Width * Part, in[j + 1]), ...);
  }
  if (j < columns) (add_column(even[Part], values + Width * Part, in[j]), ...);
  ((even[Part] += odd[Part]), ...);
  (__builtin_memcpy(out + Width * Part, &even[Part], sizeof(Rows)), ...);
}

[[gnu::always_inline]] inline const double* part_of(const double* before, size_t row) {
  return before == nullptr ? nullptr : before + row;
}

template <size_t Width>
[[gnu::always_inline]] inline void multiply_all(const double* values, size_t rows, size_t columns,
                                                const double* before, const double* in, double* out) {
  constexpr std::make_index_sequence<8 / Width> eight;
  constexpr std::make_index_sequence<16 / Width> sixteen;
  size_t row = 0;
  for (; row + 16 <= rows; row += 16)
    multiply_rows<Width>(values + row, rows, columns, part_of(before, row), in, out + row, sixteen);
  if (row < rows)
    multiply_rows<Width>(values + row, rows, columns, part_of(before, row), in, out + row, eight);
}

using Multiply = void (*)(const double*, size_t, size_t, const double*, const double*, double*);

void multiply_narrow(const double* values, size_t rows, size_t columns, const double* before,
                     const double* in, double* out) {
  multiply_all<2>(values, rows, columns, before, in, out);
}

#if defined(__x86_64__)
[[gnu::target("avx2,fma")]] void multiply_wide(const double* values, size_t rows, size_t columns,
                                               const double* before, const double* in, double* out) {
  multiply_all<4>(values, rows, columns, before, in, out);
}

[[gnu::target("avx512f")]] void multiply_widest(const double* values, size_t rows, size_t columns,
                                                const double* before, const double* in, double* out) {
  multiply_all<8>(values, rows, columns, before, in, out);
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

SmallMatrix::SmallMatrix(const Eigen::MatrixXd& matrix)
    : values_(static_cast<size_t>(padded(matrix.rows()) / 8 * matrix.cols())),
      rows_(static_cast<size_t>(padded(matrix.rows()))),
      columns_(static_cast<size_t>(matrix.cols())) {
  for (size_t j = 0; j < columns_; ++j)
    for (size_t i = 0; i < static_cast<size_t>(matrix.rows()); ++i)
      values_[(j * rows_ + i) / 8].values[i % 8] =
          matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
}

void SmallMatrix::multiply(const double* before, const double* in, double* out) const {
  static const Multiply product = best();
  product(reinterpret_cast<const double*>(values_.data()), rows_, columns_, before, in, out);
}

}  // namespace diastole::rig
