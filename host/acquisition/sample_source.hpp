#pragma once
// One numbered stream of samples, whatever instrument it comes from.
//
// Sample k is due at first_due + k / rate. A source gives every index exactly once and in order, as received or
// as missing with a reason: so received + missing = expected by construction, in whatever way an instrument
// stalls, fails or comes back.
//
//   PolledSource    asks a PolledInstrument when a sample is due. Missing is what the instrument failed to
//                   answer, what came due while it kept the asker waiting, and what the asker itself was too
//                   late for (an overrun).
//   BlockSource     takes a BlockInstrument's numbered blocks. Missing is what lies between two of them, before
//                   the first, and at the end what should have been there. After a failure the scan is started
//                   anew; what came due meanwhile is missing.
//   ThreadedSource  lets another source run on a thread of its own, in real time, so that a slow instrument
//                   costs neither heartbeats nor other events.

#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "host/daq/instrument.hpp"
#include "host/transport/clock.hpp"

namespace diastole {

inline constexpr double ns_per_s = 1e9;

/// Consecutive samples, row by row.
struct Received {
  uint64_t first_index = 0;
  std::vector<uint64_t> host_ns;  ///< one a sample: when it was taken
  std::vector<double> volts;
};

struct Missing {
  uint64_t first_index = 0;
  uint64_t count = 0;
  std::string reason;
};

/// The instrument's own clock and the host's, read together.
struct InstrumentTime {
  uint64_t host_ns = 0;
  uint64_t half_round_trip_ns = 0;
  uint32_t timer = 0;
};

/// The instrument fails; which samples that costs is known later.
struct InstrumentFault {
  std::string text;
};

using SourceItem = std::variant<Received, Missing, InstrumentTime, InstrumentFault>;

/// Sample k of a source is due at first_due_ns + k / rate_Hz.
struct SampleGrid {
  uint64_t first_due_ns = 0;
  double rate_Hz = 300;

  [[nodiscard]] uint64_t due_ns(uint64_t index) const;
  /// How many samples are due at or before `now_ns`.
  [[nodiscard]] uint64_t due_by(uint64_t now_ns) const;
};

/// What InstrumentTime::timer counts.
struct TimerFacts {
  double rate_Hz = 0;           ///< 0: the instrument has no clock
  bool counts_samples = false;  ///< then sample k was taken when the timer read k
};

class SampleSource {
 public:
  virtual ~SampleSource() = default;

  [[nodiscard]] virtual TimerFacts timer(double rate_Hz) const = 0;

  /// Begins; returns where the grid lies, sample 0 at or shortly after the clock's present.
  virtual SampleGrid start(double rate_Hz) = 0;
  /// What came since the last call. May wait for the instrument.
  virtual std::vector<SourceItem> take() = 0;
  /// When take() may have something next.
  [[nodiscard]] virtual uint64_t next_due_ns() const = 0;
  /// Whether take() has given everything that was due at or before `until_ns`, or will never have it.
  [[nodiscard]] virtual bool complete(uint64_t until_ns) const = 0;
  /// Ends the stream: what was due at or before `until_ns` and has not come is missing.
  virtual std::vector<SourceItem> finish(uint64_t until_ns) = 0;
};

/// The source for an instrument; on its own thread unless the clock stands still between sleeps (conducted
/// time, tests), where all of a session happens in one order.
std::unique_ptr<SampleSource> make_source(Clock& clock, daq::Instrument& instrument);

}  // namespace diastole
