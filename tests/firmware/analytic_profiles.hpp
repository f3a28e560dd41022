#pragma once
// The waveforms as the documentation defines them, in long double and piece by piece, independent of the
// firmware's arithmetic: the phases at which the volume crosses y on its way up and on its way down.

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "tests/firmware/uploaded_waveform.hpp"

namespace diastole::firmware {

using Real = long double;

struct AnalyticProfile {
  std::function<Real(Real phase)> volume;
  std::function<Real(Real y)> phase_rising;
  std::function<Real(Real y)> phase_falling;
};

/// Constant acceleration, even speed, constant deceleration. Its crossings are found by bisection, so that no
/// inverse formula is shared with the firmware.
inline Real flank_volume(Real p, Real length, Real blend) {
  if (p <= 0) return 0;
  if (p >= length) return 1;
  const Real speed = 1 / (length - blend);
  if (p < blend) return speed * p * p / (2 * blend);
  if (p > length - blend) return 1 - speed * (length - p) * (length - p) / (2 * blend);
  return speed * (p - blend / 2);
}

inline Real bisect(const std::function<Real(Real)>& volume, Real below, Real above, Real y) {
  for (int i = 0; i < 80; ++i) {
    const Real middle = (below + above) / 2;
    (volume(middle) < y ? below : above) = middle;
  }
  return below;
}

/// Up from phase 0, down to the least volume at phase `down`.
inline AnalyticProfile even_flanks(Real up_length, Real down_length, Real down, Real blend) {
  const auto volume = [=](Real phase) {
    return phase < up_length ? flank_volume(phase, up_length, blend)
                             : flank_volume(down - phase, down_length, blend);
  };
  return {volume, [=](Real y) { return bisect(volume, 0, up_length, y); },
          [=](Real y) { return bisect(volume, down, down - down_length, y); }};
}

/// Its greatest volume is that of point 29.
inline AnalyticProfile uploaded_heart() {
  const auto volume = [](Real phase) { return uploaded_volume(kHeartRises, phase); };
  return {volume, [=](Real y) { return bisect(volume, 0, 29.0L / 48, y); },
          [=](Real y) { return bisect(volume, 1, 29.0L / 48, y); }};
}

inline const std::map<std::string, AnalyticProfile>& analytic_profiles() {
  static const std::map<std::string, AnalyticProfile> kProfiles = [] {
    const auto parabolic = [](Real y) {
      return y <= 0.5L ? std::sqrt(y / 8) : 0.5L - std::sqrt((1 - y) / 8);
    };
    const auto parabola = [](Real phase) {
      if (phase > 0.5L) phase = 1 - phase;
      return phase < 0.25L ? 8 * phase * phase : 1 - 8 * (0.5L - phase) * (0.5L - phase);
    };
    const auto sinusoidal = [](Real y) { return std::acos(1 - 2 * y) / (2 * std::numbers::pi_v<Real>); };
    const auto sine = [](Real phase) { return (1 - std::cos(2 * std::numbers::pi_v<Real> * phase)) / 2; };
    return std::map<std::string, AnalyticProfile>{
        {"parabolic", {parabola, parabolic, [=](Real y) { return 1 - parabolic(y); }}},
        {"sinusoidal", {sine, sinusoidal, [=](Real y) { return 1 - sinusoidal(y); }}},
        {"trapezoidal", even_flanks(0.25L, 0.25L, 0.75L, 0.05L)},
        {"sawtooth", even_flanks(0.75L, 0.25L, 1, 0.04L)},
        {"reversed_sawtooth", even_flanks(0.25L, 0.75L, 1, 0.04L)},
        {"uploaded", uploaded_heart()},
    };
  }();
  return kProfiles;
}

}  // namespace diastole::firmware
