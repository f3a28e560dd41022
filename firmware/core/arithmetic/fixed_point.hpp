#pragma once
// Fractions of one as 64-bit integers (Q64: value = integer / 2^64), with results that are equal to the last
// bit on host and target: integer arithmetic, and the single-precision square root, which IEEE 754 rounds
// correctly everywhere (VSQRT.F32 on the Cortex-M4F).

#include <cstdint>

namespace diastole::firmware {

using Q64 = std::uint64_t;

inline constexpr Q64 kHalf = Q64{1} << 63;

/// Upper 64 bits of the 128-bit product.
constexpr std::uint64_t multiply_high(std::uint64_t a, std::uint64_t b) {
  const std::uint64_t a_low = a & 0xFFFFFFFFU, a_high = a >> 32;
  const std::uint64_t b_low = b & 0xFFFFFFFFU, b_high = b >> 32;
  const std::uint64_t middle = a_high * b_low + (a_low * b_low >> 32);
  const std::uint64_t other = a_low * b_high + (middle & 0xFFFFFFFFU);
  return a_high * b_high + (middle >> 32) + (other >> 32);
}

/// numerator / denominator, rounded down. Precondition: numerator < denominator.
constexpr Q64 ratio(std::uint32_t numerator, std::uint32_t denominator) {
  const std::uint64_t first = std::uint64_t{numerator} << 32;
  const std::uint64_t high = first / denominator;
  const std::uint64_t rest = (first - high * denominator) << 32;
  return high << 32 | rest / denominator;
}

/// round(whole · fraction). Precondition: whole < 2^62.
constexpr std::uint64_t scale(std::uint64_t whole, Q64 fraction) {
  return (multiply_high(whole << 1, fraction) + 1) >> 1;
}

/// Square root with a relative error below 2^-44: a seed from the 24 leading bits, then one Newton step on
/// the exact remainder, √n = r + (n - r²) / 2r. The step is below 2^9 last places of r, so single precision has
/// digits enough for it. Precondition: fraction <= 1 - 2^-32.
Q64 square_root(Q64 fraction);

}  // namespace diastole::firmware
