#pragma once
// A data acquisition instrument that is asked for one sample at a time.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace diastole::daq {

/// How a reading went; `fault` says in words why there is no sample.
struct Outcome {
  bool ok = true;
  std::string fault;
};

class Instrument {
 public:
  virtual ~Instrument() = default;

  /// "modbus-tcp at 192.168.1.207:502", for messages and the run's journal.
  [[nodiscard]] virtual std::string describe() const = 0;
  [[nodiscard]] virtual size_t channels() const = 0;

  /// Reads all channels now, in volts, into volts[channels()]. After a failure the instrument has brought
  /// itself back into step or tries again at the next reading: a value is never that of an earlier question.
  virtual Outcome read(std::span<double> volts) = 0;

  /// The instrument's own clock, if it has one: a counter of `timer_rate_Hz` that wraps at 32 bits.
  virtual std::optional<uint32_t> read_timer() { return std::nullopt; }
  [[nodiscard]] virtual double timer_rate_Hz() const { return 0; }
};

}  // namespace diastole::daq
