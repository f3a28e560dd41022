#pragma once
// USART3 with a ring each way, filled and emptied by its interrupt.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/core/ring.hpp"

namespace diastole::stm32 {

inline constexpr unsigned kBaud = 460'800;

class SerialPort {
 public:
  void start();
  std::optional<std::uint8_t> read();
  [[nodiscard]] std::size_t room() const { return kSendBytes - sending_.size(); }
  /// Precondition: bytes.size() <= room().
  void write(std::span<const std::uint8_t> bytes);
  /// USART3's interrupt; true when the byte that came ends a frame. A byte that finds the ring full, or that
  /// overran, is missing: its frame fails its CRC and is repeated.
  bool interrupt();

 private:
  void send_next();

  static constexpr std::size_t kSendBytes = 2048;
  firmware::Ring<std::uint8_t, 1024> received_;
  firmware::Ring<std::uint8_t, kSendBytes> sending_;
};

}  // namespace diastole::stm32
