#pragma once
// The waveforms that the host has uploaded. All share one memory of 4096 points.
//
// A waveform of n points a cycle is kept as its n rises from point to point at even phases, the last of them
// back to the first: 16 bits each, in units of which the whole stroke has `full_scale`. Sums of rises are
// exact, so ordinates have more than 16 bits: the host chooses the unit such that the largest rise nearly
// fills its 16 bits. A waveform is accepted when it begins at its least volume and ends where it began.

#include <array>
#include <cstdint>
#include <span>

#include "protocol/wire/faults.hpp"
#include "protocol/wire/program_messages.hpp"
#include "protocol/wire/result.hpp"

namespace diastole::firmware {

struct UploadedWaveform {
  std::span<const std::int16_t> rises;  ///< from point i to point i + 1, the last one back to the first
  std::int32_t full_scale = 0;          ///< greatest volume over the first point's: the stroke
  /// max |dy/dphase| and max |d²y/dphase²| of the curve (knot_cubic.hpp) over the stroke, in millionths, rounded up.
  std::uint32_t peak_speed_millionths = 0;
  std::uint32_t peak_acceleration_millionths = 0;

  /// Rises around the cycle: interval -1 is the last, interval n the first.
  [[nodiscard]] std::int32_t rise(std::int32_t interval) const {
    const auto count = static_cast<std::int32_t>(rises.size());
    if (interval < 0) interval += count;
    if (interval >= count) interval -= count;
    return rises[static_cast<std::size_t>(interval)];
  }
};

/// The waveform of `rises`, or none if it leaves the least volume downwards, does not close, never moves, or is
/// steeper than 4294 strokes a period or a period squared.
wire::Result<UploadedWaveform, wire::Refusal> make_waveform(std::span<const std::int16_t> rises);

class WaveformStore {
 public:
  static constexpr std::size_t kPoints = wire::kMaxWaveformPoints;
  static constexpr std::size_t kWaveforms = wire::kMaxWaveforms;

  /// Forgets all waveforms.
  void clear() { waveforms_ = used_ = expected_ = 0; }
  [[nodiscard]] std::size_t room() const { return kPoints - used_; }

  /// Begins waveform `number`, which must be the next one, from 0; an unfinished one is dropped.
  /// `crc` is the CRC-32 of all rises as little-endian bytes.
  wire::Refusal begin(std::uint8_t number, std::uint16_t points, std::uint32_t crc);
  /// Takes the next rises; the last of them closes the waveform, or drops it if it is not as announced.
  wire::Refusal append(std::uint16_t first, std::span<const std::int16_t> rises);

  /// A finished waveform, or nullptr. It stays in place until clear().
  [[nodiscard]] const UploadedWaveform* find(std::uint8_t number) const {
    return number < waveforms_ ? &waveform_[number] : nullptr;
  }

 private:
  wire::Refusal finish();

  std::array<std::int16_t, kPoints> rises_{};
  std::array<UploadedWaveform, kWaveforms> waveform_{};
  std::size_t waveforms_ = 0;  ///< finished
  std::size_t used_ = 0;       ///< rises of finished waveforms
  std::size_t expected_ = 0;   ///< of the one that is being uploaded; 0: none is
  std::size_t received_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace diastole::firmware
