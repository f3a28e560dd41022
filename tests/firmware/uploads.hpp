#pragma once
// The messages that upload a waveform.

#include <algorithm>
#include <span>

#include "protocol/wire/crc32.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole::firmware {

inline wire::UploadWaveform upload_of(std::uint8_t number, std::span<const std::int16_t> rises) {
  wire::Crc32 crc;
  for (const std::int16_t rise : rises) {
    crc.add(static_cast<std::uint8_t>(rise & 0xFF));
    crc.add(static_cast<std::uint8_t>((rise >> 8) & 0xFF));
  }
  return {0, number, static_cast<std::uint16_t>(rises.size()), crc.value()};
}

inline wire::WaveformPoints lot_of(std::span<const std::int16_t> rises, std::size_t first) {
  wire::WaveformPoints lot;
  lot.first = static_cast<std::uint16_t>(first);
  const auto part = rises.subspan(first, std::min(wire::WaveformPoints::kMaxCount, rises.size() - first));
  lot.count = static_cast<std::uint8_t>(part.size());
  std::copy(part.begin(), part.end(), lot.rise.begin());
  return lot;
}

}  // namespace diastole::firmware
