#pragma once
// A line that carries bytes both ways without blocking: what the controller's client sees of a serial port.

#include <cstddef>
#include <cstdint>
#include <span>

namespace diastole {

class ByteLine {
 public:
  virtual ~ByteLine() = default;

  /// Takes bytes to send; what the line does not accept at once is kept and sent by the next write or flush.
  virtual void write(std::span<const uint8_t> bytes) = 0;
  /// Takes what has arrived, at most out.size(); 0 if nothing has.
  virtual size_t read(std::span<uint8_t> out) = 0;

  /// Sends what is kept, waiting at most `most_ms` for the line to take it.
  virtual void flush(int most_ms) = 0;
  /// Waits at most `most_ms` of wall time until `total` bytes have arrived since the line was opened.
  virtual void wait_received(uint64_t total, int most_ms) = 0;

  /// True once the other end is gone; the line must then be opened anew.
  [[nodiscard]] virtual bool lost() const = 0;
  /// Bytes that left, and bytes that arrived (read or not), since the line was opened.
  [[nodiscard]] virtual uint64_t written_total() const = 0;
  [[nodiscard]] virtual uint64_t received_total() const = 0;
  /// For poll(2); -1 if there is none.
  [[nodiscard]] virtual int descriptor() const = 0;
};

}  // namespace diastole
