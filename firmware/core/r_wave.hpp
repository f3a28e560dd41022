#pragma once
// The simulated ECG R-wave: a triangle, 30 ms long and 20 mV high at the scanner's input unless the settings say otherwise.
// The DAC plays it in 300 steps, paced by a timer that the TTL's compare event starts. 20 mV are 2.5 V at the DAC behind the
// board's divider of 1 : 125.

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/core/units.hpp"
#include "protocol/wire/machine_settings.hpp"

namespace diastole::firmware {

/// How TTL and R-wave look; ranges in setting_list.inc.
struct SignalSettings {
  bool ttl_active_low = false;
  std::uint32_t r_wave_uV = 20'000;
  std::uint32_t r_wave_us = 30'000;

  SignalSettings() = default;
  explicit SignalSettings(const wire::MachineSettings& machine)
      : ttl_active_low(machine.ttl_active_low != 0),
        r_wave_uV(static_cast<std::uint32_t>(machine.r_wave_uV)),
        r_wave_us(static_cast<std::uint32_t>(machine.r_wave_us)) {}
};

inline constexpr std::size_t kRWaveSamples = 300;
inline constexpr std::uint32_t kDacFullScale = 4095;
inline constexpr std::uint32_t kDacFullScale_uV = 3'300'000;
inline constexpr std::uint32_t kRWaveDivider = 125;

/// From one sample to the next, rounded.
constexpr Ticks r_wave_sample_period(std::uint32_t r_wave_us) {
  return {(std::int64_t{r_wave_us} * kTicksPerMicrosecond + std::int64_t{kRWaveSamples} / 2) /
          std::int64_t{kRWaveSamples}};
}

/// Sample i leaves the DAC i sample periods after the start; before the first and after the last it is 0.
using RWaveCodes = std::array<std::uint16_t, kRWaveSamples>;

constexpr RWaveCodes r_wave_codes(std::uint32_t peak_uV) {
  constexpr std::size_t half = kRWaveSamples / 2;
  RWaveCodes codes{};
  for (std::size_t i = 0; i < kRWaveSamples; ++i) {
    const std::uint64_t height = i < half ? i + 1 : kRWaveSamples - 1 - i;
    const std::uint64_t scaled = height * peak_uV * kRWaveDivider * kDacFullScale;
    codes[i] = static_cast<std::uint16_t>((scaled + half * kDacFullScale_uV / 2) / (half * kDacFullScale_uV));
  }
  return codes;
}

/// Microvolts at the scanner's input for a DAC code.
constexpr std::uint32_t r_wave_uV(std::uint16_t code) {
  return static_cast<std::uint32_t>(
      (std::uint64_t{code} * kDacFullScale_uV / kDacFullScale + kRWaveDivider / 2) / kRWaveDivider);
}

}  // namespace diastole::firmware
