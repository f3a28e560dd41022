#pragma once
// The simulated ECG R-wave: a triangle 30 ms long and 20 mV high at the scanner's input. The DAC plays it in
// 100 µs steps, paced by a timer that the TTL's compare event starts. 20 mV are 2.5 V at the DAC behind the
// board's divider of 1 : 125.

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/core/units.hpp"

namespace diastole::firmware {

inline constexpr std::size_t kRWaveSamples = 300;
inline constexpr Ticks kRWaveSamplePeriod = microseconds(100);
inline constexpr std::uint32_t kDacFullScale = 4095;
inline constexpr std::uint32_t kDacFullScale_uV = 3'300'000;
inline constexpr std::uint32_t kRWaveDivider = 125;
inline constexpr std::uint32_t kRWavePeak_uV = 20'000;

/// Sample i leaves the DAC i sample periods after the start; before the first and after the last it is 0.
inline constexpr std::array<std::uint16_t, kRWaveSamples> kRWaveCodes = [] {
  constexpr std::size_t half = kRWaveSamples / 2;
  std::array<std::uint16_t, kRWaveSamples> codes{};
  for (std::size_t i = 0; i < kRWaveSamples; ++i) {
    const std::uint64_t height = i < half ? i + 1 : kRWaveSamples - 1 - i;
    const std::uint64_t scaled = height * kRWavePeak_uV * kRWaveDivider * kDacFullScale;
    codes[i] = static_cast<std::uint16_t>((scaled + half * kDacFullScale_uV / 2) / (half * kDacFullScale_uV));
  }
  return codes;
}();

/// Microvolts at the scanner's input for a DAC code.
constexpr std::uint32_t r_wave_uV(std::uint16_t code) {
  return static_cast<std::uint32_t>(
      (std::uint64_t{code} * kDacFullScale_uV / kDacFullScale + kRWaveDivider / 2) / kRWaveDivider);
}

}  // namespace diastole::firmware
