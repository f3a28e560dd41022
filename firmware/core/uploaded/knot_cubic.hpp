#pragma once
// The curve between two neighbouring points of an uploaded waveform: a cubic that meets its neighbours with
// equal slope (C¹) and never leaves the range of its two ends (Fritsch and Carlson, SIAM J. Numer. Anal. 17,
// 1980). With the phase u from 0 to 1 across the interval, d its rise, and e, f the rises of the intervals before and after:
//
//   slope where two rises a, b meet   m = (a + b) / 2, but no steeper than 3 min(|a|, |b|), and 0 where a b <= 0
//   y(u) = y(0) + m0 u + (3d - 2 m0 - m1) u² + (m0 + m1 - 2d) u³        m0 = m(e, d), m1 = m(d, f)
//
// Three points on a parabola give the parabola; a highest or lowest point is at rest. Everything is an integer
// when 2y is taken. A falling interval is turned over, so that here the curve always rises.

#include <cstdint>

namespace diastole::firmware {

struct KnotCubic {
  /// 2 (y(u) - y(0)) = linear u + square u² + cube u³, of size below 2^19 each; turned over if the interval falls.
  std::int32_t linear = 0;
  std::int32_t square = 0;
  std::int32_t cube = 0;

  /// The interval that rises by `rise` (not 0) between ones that rise by `before` and `after`.
  static constexpr KnotCubic between(std::int32_t before, std::int32_t rise, std::int32_t after) {
    const std::int32_t sign = rise < 0 ? -1 : 1;
    const std::int32_t d = sign * rise;
    const std::int32_t first = twice_slope(sign * before, d), last = twice_slope(d, sign * after);
    return {first, 6 * d - 2 * first - last, first + last - 4 * d};
  }

  /// Largest slope of 2y in the interval, rounded up: at an end, or where the slope itself turns.
  [[nodiscard]] constexpr std::int64_t steepest() const {
    const std::int64_t last = std::int64_t{linear} + 2 * std::int64_t{square} + 3 * std::int64_t{cube};
    const std::int64_t ends = linear > last ? linear : last;
    if (cube >= 0 || square <= 0 || square >= -3 * std::int64_t{cube}) return ends;
    const std::int64_t thrice = -3 * std::int64_t{cube};
    const std::int64_t inside = linear + (std::int64_t{square} * square + thrice - 1) / thrice;
    return inside > ends ? inside : ends;
  }
  /// Largest size of the second derivative of 2y: at one of the ends, for it is linear.
  [[nodiscard]] constexpr std::int64_t hardest() const {
    const std::int64_t first = 2 * std::int64_t{square}, last = first + 6 * std::int64_t{cube};
    const std::int64_t a = first < 0 ? -first : first, b = last < 0 ? -last : last;
    return a > b ? a : b;
  }

 private:
  static constexpr std::int32_t twice_slope(std::int32_t a, std::int32_t b) {
    if (a <= 0 || b <= 0) return 0;
    const std::int32_t most = 6 * (a < b ? a : b);
    return a + b < most ? a + b : most;
  }
};

}  // namespace diastole::firmware
