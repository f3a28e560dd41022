#pragma once
// A serial port through termios: raw, eight bits, no flow control, for this process alone (TIOCEXCL against
// other programs' open, flock against our own as root, whom TIOCEXCL does not stop).

#include <string>
#include <vector>

#include "host/transport/byte_line.hpp"
#include "host/transport/descriptor.hpp"

namespace diastole {

class SerialPort final : public ByteLine {
 public:
  /// Throws HardwareError when the port is absent, forbidden, busy, no terminal, or has no such rate.
  SerialPort(const std::string& path, unsigned baud);

  void write(std::span<const uint8_t> bytes) override;
  size_t read(std::span<uint8_t> out) override;
  void flush(int most_ms) override;
  void wait_received(uint64_t total, int most_ms) override;
  [[nodiscard]] bool lost() const override { return lost_; }
  [[nodiscard]] uint64_t written_total() const override { return written_total_; }
  [[nodiscard]] uint64_t received_total() const override { return received_total_; }
  [[nodiscard]] int descriptor() const override { return port_.get(); }

 private:
  void send_kept();
  void take_in();
  bool wait_for(short events, int most_ms) const;

  Descriptor port_;
  std::vector<uint8_t> to_send_;
  std::vector<uint8_t> arrived_;
  uint64_t written_total_ = 0;
  uint64_t received_total_ = 0;
  bool lost_ = false;
};

}  // namespace diastole
