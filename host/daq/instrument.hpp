#pragma once
// A data acquisition instrument. There are two kinds:
//
//   PolledInstrument   is asked for one sample at a time; the host decides when
//   BlockInstrument    samples by its own clock once it is started, numbers what it takes, and hands it over in
//                      blocks, late
//
// What a driver opens is one of the two; host/acquisition/sample_source.hpp makes one numbered stream of
// either.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace diastole::daq {

/// How a reading went; `fault` says in words why there is no sample.
struct Outcome {
  bool ok = true;
  std::string fault;
};

/// What an instrument makes of a sample rate.
struct RatePlan {
  double rate_Hz = 0;   ///< at which it samples
  std::string warning;  ///< with numbers, when it cannot keep that up; empty: it can
};

class Instrument {
 public:
  virtual ~Instrument() = default;

  /// "modbus-tcp at 192.168.1.207:502", for messages and the run's journal.
  [[nodiscard]] virtual std::string describe() const = 0;
  [[nodiscard]] virtual size_t channels() const = 0;
  /// Throws InputError if the instrument has no such rate, naming the nearest.
  [[nodiscard]] virtual RatePlan plan_rate(double asked_Hz) const { return {asked_Hz, {}}; }
};

class PolledInstrument : public Instrument {
 public:
  /// Reads all channels now, in volts, into volts[channels()]. After a failure the instrument has brought
  /// itself back into step or tries again at the next reading: a value is never that of an earlier question.
  virtual Outcome read(std::span<double> volts) = 0;

  /// The instrument's own clock, if it has one: a counter of `timer_rate_Hz` that wraps at 32 bits.
  virtual std::optional<uint32_t> read_timer() { return std::nullopt; }
  [[nodiscard]] virtual double timer_rate_Hz() const { return 0; }
};

/// Consecutive samples of all channels, row by row.
struct Batch {
  uint64_t first_index = 0;  ///< since start(); what lies between batches was lost
  std::vector<double> volts;
};

class BlockInstrument : public Instrument {
 public:
  /// Samples in one block: a sample comes as much later as the block's others take.
  [[nodiscard]] virtual size_t block_samples() const = 0;
  /// Begins to sample at a rate that plan_rate() gave; sample 0 is taken when this returns.
  virtual Outcome start(double rate_Hz) = 0;
  /// Waits for a block, a quarter of a second at most longer than one takes, and gives 0 … n samples. After a
  /// failure only start() brings it back, with indices from 0.
  virtual Outcome read(Batch& out) = 0;
  virtual void stop() = 0;
};

}  // namespace diastole::daq
