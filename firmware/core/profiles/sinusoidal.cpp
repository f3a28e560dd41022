// y = (1 - cos 2π phase) / 2 = sin² π phase, hence phase = asin(√y) / π. The series
//   asin(√z) / √z = Σ c_n z^n,  c_0 = 1,  c_{n+1} = c_n (2n+1)² / ((2n+2)(2n+3))
// is used up to z = sin²(π/8) = 0.1465, where 14 terms leave 1e-14; larger angles are halved once:
// sin²(φ/2) = (1 - √(1 - sin²φ)) / 2.

#include <array>

#include "firmware/core/profiles/profile.hpp"

namespace diastole::firmware {

namespace {

constexpr std::size_t kTerms = 14;
/// z^4 is below 2^-11: from there on 32 bits leave as little as 64 bits do before.
constexpr std::size_t kLongTerms = 4;

template <class Integer>
constexpr double kOne = sizeof(Integer) == 8 ? 18446744073709551616.0 : 4294967296.0;

template <class Integer, std::size_t first, std::size_t count>
constexpr std::array<Integer, count> series_over_pi() {
  std::array<Integer, count> terms{};
  double term = 0.31830988618379067154;
  for (std::size_t n = 0; n < first + count; ++n) {
    if (n >= first) terms[n - first] = static_cast<Integer>(term * kOne<Integer>);
    const auto even = static_cast<double>(2 * n);
    term *= (even + 1) * (even + 1) / ((even + 2) * (even + 3));
  }
  return terms;
}
constexpr auto kLong = series_over_pi<Q64, 0, kLongTerms>();
constexpr auto kShort = series_over_pi<std::uint32_t, kLongTerms, kTerms - kLongTerms>();

constexpr Q64 kSineSquaredOfEighth = 0x257D'8666'0000'0000U;  // sin²(π/8) = 0.14645

/// asin(√z) / π for z up to sin²(π/8).
Q64 series(Q64 z) {
  const std::uint64_t short_z = z >> 32;
  std::uint32_t short_sum = 0;
  for (std::size_t n = kShort.size(); n-- > 0;)
    short_sum = static_cast<std::uint32_t>(short_sum * short_z >> 32) + kShort[n];
  Q64 sum = Q64{short_sum} << 32;
  for (std::size_t n = kLong.size(); n-- > 0;)
    sum = multiply_high(sum, z) + kLong[n];
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
