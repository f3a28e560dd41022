#pragma once
// A ventricle's volume over one beat as the host uploads it: rapid filling, diastasis, atrial contraction,
// ejection; 48 points. And the curve through uploaded points as its documentation defines it, in long double.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "firmware/core/uploaded/waveform_store.hpp"

namespace diastole::firmware {

inline constexpr long double kOne = 18446744073709551616.0L;  // of a Q64

inline constexpr std::array<std::int16_t, 48> kHeartRises = {
    3358,   9422,   14508,  18616,  21745,  23897,  25071,  25267,  24484,  22789,  20679,  17630,
    13488,  8252,   3226,   2881,   2972,   2950,   2811,   2558,   4468,   9457,   12822,  14473,
    14846,  14015,  11585,  7558,   2073,   -230,   -5655,  -12492, -18341, -23202, -27076, -29961,
    -31858, -32767, -32688, -31621, -29566, -26522, -22491, -17472, -11464, -4469,  -26,    0,
};

inline const UploadedWaveform& heart_waveform() {
  static const UploadedWaveform kHeart = *make_waveform(kHeartRises);
  return kHeart;
}

/// y at a phase: the limited three-point slopes and the cubic in Hermite's form (firmware/core/uploaded/knot_cubic.hpp has the powers).
inline long double uploaded_volume(std::span<const std::int16_t> rises, long double phase) {
  using Real = long double;
  const auto count = static_cast<std::int64_t>(rises.size());
  const auto at = [&](std::int64_t i) {
    return Real{1} * rises[static_cast<std::size_t>((i + count) % count)];
  };
  const auto slope = [&](std::int64_t i) {
    const Real a = at(i - 1), b = at(i);
    if (a * b <= 0) return Real{0};
    const Real most = 3 * std::min(std::abs(a), std::abs(b));
    return std::clamp((a + b) / 2, -most, most);
  };
  Real height = 0, top = 0, sum = 0;
  const auto knot = std::min(static_cast<std::int64_t>(phase * static_cast<Real>(count)), count - 1);
  for (std::int64_t i = 0; i < count; ++i) {
    if (i == knot) height = sum;
    sum += at(i);
    top = std::max(top, sum);
  }
  const Real u = phase * static_cast<Real>(count) - static_cast<Real>(knot);
  const Real rise = u * u * (3 - 2 * u), left = u * (1 - u) * (1 - u), right = -u * u * (1 - u);
  return (height + at(knot) * rise + slope(knot) * left + slope(knot + 1) * right) / top;
}

}  // namespace diastole::firmware
