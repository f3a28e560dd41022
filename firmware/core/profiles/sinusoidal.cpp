// y = (1 - cos 2π phase) / 2 = sin² π phase, hence phase = asin(√y) / π. The series
//   asin(√z) / √z = Σ c_n z^n,  c_0 = 1,  c_{n+1} = c_n (2n+1)² / ((2n+2)(2n+3))
// is used up to z = sin²(π/8) = 0.1465, where 14 terms leave 1e-14; larger angles are halved once:
// sin²(φ/2) = (1 - √(1 - sin²φ)) / 2.

#include <array>

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

constexpr std::array<Q64, 14> kSeriesOverPi = [] {
  std::array<Q64, 14> terms{};
  double term = 0.31830988618379067154;
  for (std::size_t n = 0; n < terms.size(); ++n) {
    terms[n] = static_cast<Q64>(term * 18446744073709551616.0);
    const auto even = static_cast<double>(2 * n);
    term *= (even + 1) * (even + 1) / ((even + 2) * (even + 3));
  }
  return terms;
}();

constexpr Q64 kSineSquaredOfEighth = 0x257D'8666'0000'0000U;  // sin²(π/8) = 0.14645

/// asin(√z) / π for z up to sin²(π/8).
Q64 series(Q64 z) {
  Q64 sum = 0;
  for (std::size_t n = kSeriesOverPi.size(); n-- > 0;)
    sum = multiply_high(sum, z) + kSeriesOverPi[n];
  return multiply_high(sum, square_root(z));
}

/// asin(√y) / π for y up to 1/2.
Q64 angle_over_pi(Q64 y) {
  if (y <= kSineSquaredOfEighth) return series(y);
  return 2 * series((0 - square_root(0 - y)) >> 1);
}

Q64 phase_rising(Q64 y) { return y <= kHalf ? angle_over_pi(y) : kHalf - angle_over_pi(0 - y); }

Q64 phase_falling(Q64 y) { return 0 - phase_rising(y); }

}  // namespace

const Profile sinusoidal_profile{phase_rising, phase_falling, 3'141'593, 19'739'209};

}  // namespace diastole::firmware
