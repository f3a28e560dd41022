#include "firmware/core/stepped_fraction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace diastole::firmware {
namespace {

void expect_ratios_up_and_down(std::uint32_t first, std::uint32_t denominator) {
  SteppedFraction fraction(first, denominator);
  std::uint64_t numerator = first;
  int steps = 0;
  ASSERT_EQ(fraction.value(), ratio(first, denominator));
  for (; steps < 5000 && numerator + 2 < denominator; ++steps) {
    numerator += 2;
    fraction.up();
    ASSERT_EQ(fraction.value(), ratio(static_cast<std::uint32_t>(numerator), denominator)) << denominator;
  }
  for (; steps > 0; --steps) {
    numerator -= 2;
    fraction.down();
    ASSERT_EQ(fraction.value(), ratio(static_cast<std::uint32_t>(numerator), denominator)) << denominator;
  }
}

TEST(SteppedFraction, EqualsTheRatioAtEveryLevelUpAndDown) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 2'000; ++trial) {
    const auto denominator =
        std::max<std::uint32_t>(2, static_cast<std::uint32_t>(random()) >> (random() % 31));
    const std::uint32_t first = trial % 2 == 0 ? 1 : static_cast<std::uint32_t>(random()) % denominator;
    ASSERT_NO_FATAL_FAILURE(expect_ratios_up_and_down(first, denominator));
  }
}

TEST(SteppedFraction, HoldsAtTheSmallestAndLargestDenominators) {
  for (const std::uint32_t denominator : {2U, 3U, 4U, 0x7FFF'FFFFU, 0x8000'0000U, 0x8000'0001U, 0xFFFF'FFFFU})
    ASSERT_NO_FATAL_FAILURE(expect_ratios_up_and_down(1, denominator));
}

TEST(SteppedFraction, TheLastOfAMillionLevelsIsExact) {
  constexpr std::uint32_t kLevels = 1'000'003;
  SteppedFraction fraction(1, 2 * kLevels);
  for (std::uint32_t i = 1; i < kLevels; ++i)
    fraction.up();
  EXPECT_EQ(fraction.value(), ratio(2 * kLevels - 1, 2 * kLevels));
}

}  // namespace
}  // namespace diastole::firmware
