#include "estimator/fe/stiffness_contraction.hpp"

#include "estimator/parallel/avx2.hpp"

namespace diastole {
namespace {

constexpr size_t first_row = 9 * 16;           // [ik][a1 b1]
constexpr size_t second_row = 16 * first_row;  // [a2 b2][ik][a1 b1]
constexpr size_t pair_rows = 10;

/// target[n] += factor * source[n]
inline void add_scaled(double* __restrict target, double factor, const double* __restrict source,
                       size_t count) {
  for (size_t n = 0; n < count; ++n)
    target[n] += factor * source[n];
}

}  // namespace

StiffnessContraction::StiffnessContraction()
    : moduli_(gauss_points * moduli),
      first_(line_points * 9 * first_row),
      second_(line_points * 4 * second_row),
      stiffness_(pair_rows * second_row) {
  const auto& line = gauss_tables().line;
  for (size_t da = 0; da < 2; ++da) {
    for (size_t db = 0; db < 2; ++db) {
      for (size_t q = 0; q < line_points; ++q) {
        for (size_t ab = 0; ab < 16; ++ab)
          pairs_[da][db][q][ab] = line[da][q][ab >> 2] * line[db][q][ab & 3];
      }
    }
  }
}

DIASTOLE_ALSO_FOR_AVX2 void StiffnessContraction::contract_first(size_t q3) {
  for (size_t q2 = 0; q2 < line_points; ++q2) {
    const double* source = &moduli_[(q3 * 4 + q2) * 4 * moduli];
    double* target = &first_[q2 * 9 * first_row];
    for (size_t kl = 0; kl < 9; ++kl) {
      const auto& pair = pairs_[kl / 3 == 0][kl % 3 == 0];
      for (size_t ik = 0; ik < 9; ++ik, target += 16) {
        const double* m = source + kl * 9 + ik;
        for (size_t ab = 0; ab < 16; ++ab) {
          target[ab] = m[0] * pair[0][ab] + m[moduli] * pair[1][ab] + m[2 * moduli] * pair[2][ab] +
                       m[3 * moduli] * pair[3][ab];
        }
      }
    }
  }
}

DIASTOLE_ALSO_FOR_AVX2 void StiffnessContraction::contract_second(size_t q3) {
  double* all = &second_[q3 * 4 * second_row];
  for (size_t n = 0; n < 4 * second_row; ++n)
    all[n] = 0.0;
  for (size_t kl = 0; kl < 9; ++kl) {
    const auto& pair = pairs_[kl / 3 == 1][kl % 3 == 1];
    double* target = all + ((kl / 3 == 2 ? 2 : 0) + (kl % 3 == 2 ? 1 : 0)) * second_row;
    for (size_t ab = 0; ab < 16; ++ab, target += first_row) {
      for (size_t q2 = 0; q2 < line_points; ++q2) {
        add_scaled(target, pair[q2][ab], &first_[(q2 * 9 + kl) * first_row], first_row);
      }
    }
  }
}

DIASTOLE_ALSO_FOR_AVX2 void StiffnessContraction::contract_third() {
  constexpr size_t block = first_row;  // keeps the sources in the nearest cache while ten rows use them
  for (size_t offset = 0; offset < second_row; offset += block) {
    for (size_t a3 = 0; a3 < 4; ++a3) {
      for (size_t b3 = a3; b3 < 4; ++b3) {
        double* target = &stiffness_[pair_row(a3, b3) * second_row + offset];
        for (size_t n = 0; n < block; ++n)
          target[n] = 0.0;
        for (size_t q3 = 0; q3 < line_points; ++q3) {
          for (size_t kl = 0; kl < 4; ++kl) {
            add_scaled(target, pairs_[kl >> 1][kl & 1][q3][a3 * 4 + b3],
                       &second_[(q3 * 4 + kl) * second_row + offset], block);
          }
        }
      }
    }
  }
}

void StiffnessContraction::contract() {
  for (size_t q3 = 0; q3 < line_points; ++q3) {
    contract_first(q3);
    contract_second(q3);
  }
  contract_third();
}

}  // namespace diastole
