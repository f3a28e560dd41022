#include "estimator/fe/gauss_contraction.hpp"

namespace diastole {
namespace {

constexpr size_t row_size = 3 * 4;           // [function or point along xi1][component]
constexpr size_t layer_size = 4 * row_size;  // [along xi2][along xi1][component]
using Cube = std::array<double, 4 * layer_size>;

/// target[n] = sum over m of factor[m] source[m * stride + n]
template <size_t Count>
inline void combine(double* __restrict target, const std::array<double, 4>& factor,
                    const double* __restrict source, size_t stride) {
  for (size_t n = 0; n < Count; ++n) {
    target[n] = factor[0] * source[n] + factor[1] * source[stride + n] + factor[2] * source[2 * stride + n] +
                factor[3] * source[3 * stride + n];
  }
}

/// The four functions at each of the four places of one direction, values or slopes, and the transpose of that.
struct LineTables {
  using Table = std::array<std::array<double, 4>, 4>;
  std::array<Table, 2> at_place;  // [is slope][place][function]
  std::array<Table, 2> at_function;

  LineTables() : at_place(gauss_tables().line) {
    for (size_t d = 0; d < 2; ++d) {
      for (size_t q = 0; q < 4; ++q) {
        for (size_t a = 0; a < 4; ++a)
          at_function[d][a][q] = at_place[d][q][a];
      }
    }
  }
};

const LineTables& lines() {
  static const LineTables tables;
  return tables;
}

void along_first(const LineTables::Table& table, const double* source, Cube& target) {
  for (size_t r = 0; r < 16; ++r) {
    for (size_t n = 0; n < 4; ++n)
      combine<3>(&target[r * row_size + 3 * n], table[n], source + r * row_size, 3);
  }
}

void along_second(const LineTables::Table& table, const Cube& source, Cube& target) {
  for (size_t l = 0; l < 4; ++l) {
    for (size_t n = 0; n < 4; ++n)
      combine<row_size>(&target[l * layer_size + n * row_size], table[n], &source[l * layer_size], row_size);
  }
}

void along_third(const LineTables::Table& table, const double* source, double* target) {
  for (size_t n = 0; n < 4; ++n)
    combine<layer_size>(target + n * layer_size, table[n], source, layer_size);
}

}  // namespace

GaussMatrices gradients_at_points(const ElementField& field) {
  const auto& [value, slope] = lines().at_place;
  Cube values;
  Cube slopes;
  Cube both;
  along_first(value, field.data(), values);
  along_first(slope, field.data(), slopes);
  GaussMatrices result;
  along_second(value, slopes, both);
  along_third(value, both.data(), result.numbers[0].data());
  along_second(slope, values, both);
  along_third(value, both.data(), result.numbers[1].data());
  along_second(value, values, both);
  along_third(slope, both.data(), result.numbers[2].data());
  return result;
}

ElementField force_of(const GaussMatrices& p) {
  const auto& [value, slope] = lines().at_function;
  Cube of_first;
  Cube of_second;
  Cube of_third;
  along_third(value, p.numbers[0].data(), of_first.data());
  along_third(value, p.numbers[1].data(), of_second.data());
  along_third(slope, p.numbers[2].data(), of_third.data());
  Cube slopes;
  Cube values;
  Cube more;
  along_second(value, of_first, slopes);
  along_second(slope, of_second, values);
  along_second(value, of_third, more);
  for (size_t n = 0; n < values.size(); ++n)
    values[n] += more[n];
  ElementField force;
  along_first(value, values.data(), more);
  along_first(slope, slopes.data(), of_first);
  for (size_t n = 0; n < more.size(); ++n)
    force.data()[n] = more[n] + of_first[n];
  return force;
}

}  // namespace diastole
