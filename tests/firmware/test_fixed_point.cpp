#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "firmware/core/arithmetic/fixed_point.hpp"

namespace diastole::firmware {
namespace {

constexpr long double kUnit = 18446744073709551616.0L;

TEST(FixedPoint, MultiplyHighIsTheUpperHalfOfTheProduct) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100'000; ++i) {
    const std::uint64_t a = random() >> (random() % 64), b = random() >> (random() % 64);
    const auto exact = static_cast<std::uint64_t>((static_cast<unsigned __int128>(a) * b) >> 64);
    ASSERT_EQ(multiply_high(a, b), exact);
  }
  EXPECT_EQ(multiply_high(~0ULL, ~0ULL), ~0ULL - 1);
}

TEST(FixedPoint, RatioIsRoundedDownExactly) {
  std::mt19937 random(2);
  for (int i = 0; i < 100'000; ++i) {
    const auto denominator = static_cast<std::uint32_t>(random() >> (random() % 31)) | 2U;
    const auto numerator = static_cast<std::uint32_t>(random() % denominator);
    const auto exact =
        static_cast<std::uint64_t>((static_cast<unsigned __int128>(numerator) << 64) / denominator);
    ASSERT_EQ(ratio(numerator, denominator), exact);
  }
}

TEST(FixedPoint, ScaleRoundsToTheNearest) {
  EXPECT_EQ(scale(3, kHalf), 2U);
  EXPECT_EQ(scale(100, ratio(1, 3)), 33U);
  EXPECT_EQ(scale(100, ratio(2, 3)), 67U);
  EXPECT_EQ(scale(50'400'000'000, ratio(1, 2)), 25'200'000'000U);
}

TEST(FixedPoint, SquareRootIsGoodTo44Bits) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 200'000; ++i) {
    const Q64 x = (random() >> (random() % 60)) & ~(1ULL << 63);
    const long double exact = std::sqrt(static_cast<long double>(x) / kUnit);
    const long double root = static_cast<long double>(square_root(x)) / kUnit;
    ASSERT_LE(std::abs(root - exact), exact * 0x1p-44L + 1 / kUnit) << x;
  }
  EXPECT_EQ(square_root(0), 0U);
  EXPECT_EQ(square_root(kHalf >> 1), kHalf);
}

TEST(FixedPoint, SquareRootJustBelowEveryPowerOfFourDoesNotOverflow) {
  for (int places = 0; places < 60; places += 2) {
    const Q64 power = places == 0 ? 0 : Q64{1} << (64 - places);
    for (Q64 distance = places == 0 ? Q64{1} << 32 : 1; distance < (~Q64{0} >> places) / 4; distance *= 2) {
      const Q64 fraction = power - distance;
      const long double exact = std::sqrt(static_cast<long double>(fraction) / kUnit);
      const long double root = static_cast<long double>(square_root(fraction)) / kUnit;
      ASSERT_LE(std::abs(root - exact), exact * 0x1p-44L + 1 / kUnit) << fraction;
    }
  }
}

TEST(FixedPoint, SquareRootNearOneDoesNotOverflow) {
  for (std::uint64_t distance = 1ULL << 32; distance < 1ULL << 60; distance *= 3) {
    const long double exact = std::sqrt(1 - static_cast<long double>(distance) / kUnit);
    EXPECT_NEAR(static_cast<double>(static_cast<long double>(square_root(0 - distance)) / kUnit),
                static_cast<double>(exact), 1e-12);
  }
}

}  // namespace
}  // namespace diastole::firmware
