#pragma once
// The levels that a motion crosses, m/d with m going up or down by two: each follows from its neighbour by one
// addition, carrying the remainder along as Bresenham's line does, and equals ratio(m, d) to the last bit.
//
//   value = ⌊2^64 m / d⌋,  remainder = 2^64 m mod d        2^65 = step · d + step_remainder

#include <cstdint>

#include "firmware/core/arithmetic/fixed_point.hpp"

namespace diastole::firmware {

class SteppedFraction {
 public:
  SteppedFraction() = default;
  /// Begins at numerator / denominator. Precondition: numerator < denominator, 2 <= denominator.
  constexpr SteppedFraction(std::uint32_t numerator, std::uint32_t denominator)
      : value_(ratio(numerator, denominator)),
        remainder_(remainder(value_, denominator)),
        denominator_(denominator) {
    const Q64 unit = ratio(1, denominator);
    const std::uint32_t rest = remainder(unit, denominator);
    const bool carry = rest >= denominator - rest;
    step_ = 2 * unit + (carry ? 1 : 0);
    step_remainder_ = carry ? rest - (denominator - rest) : 2 * rest;
  }

  [[nodiscard]] constexpr Q64 value() const { return value_; }

  /// To (m + 2) / d; beyond 1 the value wraps.
  constexpr void up() {
    value_ += step_;
    if (remainder_ >= denominator_ - step_remainder_) {
      remainder_ -= denominator_ - step_remainder_;
      ++value_;
    } else {
      remainder_ += step_remainder_;
    }
  }
  /// To (m - 2) / d; below 0 the value wraps.
  constexpr void down() {
    value_ -= step_;
    if (remainder_ < step_remainder_) {
      remainder_ += denominator_ - step_remainder_;
      --value_;
    } else {
      remainder_ -= step_remainder_;
    }
  }

 private:
  /// 2^64 m mod d, where value = ⌊2^64 m / d⌋: less than 2^32, so the lower halves of both terms give it.
  static constexpr std::uint32_t remainder(Q64 value, std::uint32_t denominator) {
    return 0U - static_cast<std::uint32_t>(value) * denominator;
  }

  Q64 value_ = 0;
  Q64 step_ = 0;
  std::uint32_t remainder_ = 0;
  std::uint32_t step_remainder_ = 0;
  std::uint32_t denominator_ = 2;
};

}  // namespace diastole::firmware
