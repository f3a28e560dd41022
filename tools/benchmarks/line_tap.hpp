#pragma once
// A wire between the daemon and the controller's serial line that notes when a request for a stop goes by.

#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "host/transport/serial_port.hpp"
#include "protocol/wire/frame.hpp"
#include "tools/sim_controller/pty_line.hpp"

namespace diastole {

class LineTap {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  /// Opens the controller's port, and `link` for the daemon. Throws HardwareError.
  LineTap(const std::string& controller, const std::string& link);

  /// When the last byte of the first StopNow since the last call went by.
  std::optional<Instant> take_stop();

 private:
  void carry(const std::stop_token& stop);
  void look_at(std::span<const uint8_t> bytes, Instant at);

  SerialPort controller_;
  sim_controller::PtyLine daemon_;
  wire::FrameDecoder decoder_;
  std::mutex mutex_;
  std::optional<Instant> stop_;
  std::jthread thread_;  // last: it uses the members above
};

}  // namespace diastole
