#pragma once
// CRC-32 of ISO-HDLC (Ethernet, zlib): polynomial 0x04C11DB7 reflected, initial and final value 0xFFFFFFFF.
// Check value: crc32("123456789") = 0xCBF43926. Half-byte table: 64 bytes of flash.

#include <array>
#include <cstdint>
#include <span>

namespace diastole::wire {

class Crc32 {
 public:
  constexpr void add(std::uint8_t byte) {
    state_ = (state_ >> 4) ^ kNibble[(state_ ^ byte) & 0xFU];
    state_ = (state_ >> 4) ^ kNibble[(state_ ^ (byte >> 4U)) & 0xFU];
  }
  [[nodiscard]] constexpr std::uint32_t value() const { return ~state_; }

 private:
  static constexpr std::array<std::uint32_t, 16> kNibble = [] {
    std::array<std::uint32_t, 16> table{};
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      std::uint32_t remainder = i;
      for (int bit = 0; bit < 4; ++bit)
        remainder = (remainder & 1U) != 0 ? (remainder >> 1) ^ 0xEDB88320U : remainder >> 1;
      table[i] = remainder;
    }
    return table;
  }();
  std::uint32_t state_ = 0xFFFFFFFFU;
};

constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  Crc32 crc;
  for (const std::uint8_t byte : bytes)
    crc.add(byte);
  return crc.value();
}

}  // namespace diastole::wire
