// Frames are factorised at the same time, so the BLAS below CHOLMOD must not mind: OpenBLAS built for one thread has one work space for
// the process, and a product in a hundred is wrong.

#include <gtest/gtest.h>

#include <array>
#include <thread>
#include <vector>

extern "C" void dgemm_(const char* transposed_a, const char* transposed_b, const int* rows,
                       const int* columns, const int* inner, const double* alpha, const double* a,
                       const int* lead_a, const double* b, const int* lead_b, const double* beta, double* c,
                       const int* lead_c);

namespace diastole {
namespace {

constexpr int inner = 80, columns = 150;

std::vector<double> numbers(int count, int seed) {
  std::vector<double> result;
  for (int i = 0; i < count; ++i)
    result.push_back(0.25 * ((i * 7919 + seed * 104729) % 23 - 11));
  return result;
}

/// How many of the products differ from the first.
int wrong_products(int rows) {
  const std::vector<double> a = numbers(rows * inner, 2 * rows), b = numbers(inner * columns, 3 * rows + 1);
  std::vector<double> first, product(static_cast<size_t>(rows * columns));
  constexpr double one = 1, zero = 0;
  int wrong = 0;
  for (int round = 0; round < 12000; ++round) {
    dgemm_("N", "N", &rows, &columns, &inner, &one, a.data(), &rows, b.data(), &inner, &zero, product.data(),
           &rows);
    if (round == 0) first = product;
    if (product != first) ++wrong;
  }
  return wrong;
}

TEST(BlasFromThreads, ProductsAtTheSameTimeAreRight) {
  std::array<int, 2> wrong{-1, -1};
  {
    std::jthread other([&] { wrong[0] = wrong_products(77); });
    wrong[1] = wrong_products(96);
  }
  EXPECT_EQ(wrong, (std::array<int, 2>{0, 0}));
}

}  // namespace
}  // namespace diastole
