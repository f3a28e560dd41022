#pragma once
// A flank of the waveforms that move at even speed: from rest at 0 to rest at 1 over the phase r, with the
// constant acceleration v/b over the phase b at either end. With v = 1/(r - b):
//
//   y = v p²/2b            0 ≤ p ≤ b        p = √(2 b (r - b) y)       y ≤ b / 2(r - b)
//   y = v (p - b/2)        b ≤ p ≤ r - b    p = b/2 + (r - b) y        up to y = 1/2
//   y(p) = 1 - y(r - p)                     p(y) = r - p(1 - y)

#include "firmware/core/arithmetic/fixed_point.hpp"

namespace diastole::firmware {

class Flank {
 public:
  /// r = length / parts, b = blend / parts of the cycle. Precondition: 0 < 2 blend <= length < parts < 2^15.
  constexpr Flank(std::uint32_t length, std::uint32_t blend, std::uint32_t parts)
      : length_(ratio(length, parts)),
        half_blend_(ratio(blend, 2 * parts)),
        even_(ratio(length - blend, parts)),
        blend_end_(ratio(blend, 2 * (length - blend))),
        square_(ratio(2 * blend * (length - blend), parts * parts)) {}

  /// The phase from the flank's beginning to the crossing of y. Precondition: 0 < y < 1.
  [[nodiscard]] Q64 phase(Q64 y) const { return y <= kHalf ? first_half(y) : length_ - first_half(0 - y); }

 private:
  [[nodiscard]] Q64 first_half(Q64 y) const {
    return y <= blend_end_ ? square_root(multiply_high(square_, y)) : half_blend_ + multiply_high(even_, y);
  }

  Q64 length_;
  Q64 half_blend_;
  Q64 even_;
  Q64 blend_end_;  ///< y where the blend ends
  Q64 square_;     ///< p²/y in the blend
};

}  // namespace diastole::firmware
