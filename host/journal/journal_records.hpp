#pragma once
// What the payloads of a journal's records hold: each kind of record is declared here, and coded in
// journal_records.cpp, once.
//
// A document is one JSON object with the fields of its struct below under the same names; "record" holds `kind`.
// Whole numbers in it are counts, ticks or nanoseconds from 0 up to a bound, rates are positive: what is not of this
// form is no record. Fields that were added later may be absent.
//
// samples (little-endian):                     positions:
//   u64 first_index                               u32 first_index
//   u32 samples   u32 channels                    u32 count
//   samples x u64 host_ns                         u64 first_tick
//   samples x channels x f64 kPa                  u32 period_ticks
//                                                 count x i32 microsteps

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "host/journal/journal.hpp"
#include "protocol/runfile/run.hpp"
#include "protocol/runfile/session.hpp"

namespace diastole {

using Attributes = std::map<std::string, runfile::Attribute, std::less<>>;

/// More rows than a stream of any session has: 37 hours at 1 kHz. Memory is taken for every row up to the last.
inline constexpr uint64_t most_rows = uint64_t{1} << 27;
inline constexpr uint64_t most_ticks = uint64_t{1} << 62;

/// What an uploaded segment follows.
struct PlayedSegment {
  size_t segment = 0;
  std::string points;
  std::vector<double> fraction;
};

/// The first record: what was known before the start.
struct BeginRecord {
  static constexpr std::string_view kind = "begin";
  std::string run_id;
  std::string started_utc;
  std::string producer;
  std::string experiment;       ///< its text
  std::string experiment_file;  ///< where that text stood
  double sample_rate_Hz = 1;
  std::vector<std::string> channels;
  Attributes rig;
  std::string instrument;
  double tick_rate_Hz = 1;  ///< a whole number, as the next
  double microstep_pL = 0;
  double daq_timer_rate_Hz = 1;
  bool daq_timer_counts_samples = false;   ///< then sample k was taken when the timer read k
  std::vector<runfile::Segment> segments;  ///< as planned
  double trigger_delay_s = 0;
  std::vector<PlayedSegment> waveforms;
  runfile::Session session;           ///< as it was known at the start
  std::string resumes;                ///< the run_id of the run whose session goes on here
  std::vector<uint64_t> slices_done;  ///< slices, of all, that the session had imaged before
};

struct GridRecord {
  static constexpr std::string_view kind = "grid";
  uint64_t first_due_ns = 0;  ///< host time at which sample 0 is due
};

/// Of the sample stream.
struct GapRecord {
  static constexpr std::string_view kind = "gap";
  uint64_t first_index = 0;
  uint64_t count = 0;
  std::string reason;
};

/// The controller's clock against the host's.
struct ClockRecord {
  static constexpr std::string_view kind = "clock";
  uint64_t host_ns = 0;
  uint64_t tick = 0;
  uint64_t half_round_trip_ns = 0;
};

/// The instrument's timer, of 32 bits, against the host's clock.
struct InstrumentClockRecord {
  static constexpr std::string_view kind = "daq_clock";
  uint64_t host_ns = 0;
  uint64_t timer = 0;
  uint64_t half_round_trip_ns = 0;
};

struct RunStartedRecord {
  static constexpr std::string_view kind = "run_started";
  uint64_t tick = 0;
};

struct SegmentRecord {
  static constexpr std::string_view kind = "segment";
  size_t segment = 0;
  uint64_t tick = 0;
};

struct TriggerRecord {
  static constexpr std::string_view kind = "trigger";
  int64_t cycle = 0;
  uint64_t tick = 0;
  int64_t r_wave = 0;
};

/// The slice's first cycle begins.
struct SliceRecord {
  static constexpr std::string_view kind = "slice";
  std::string block;
  int64_t slice = 0;
  int64_t cycle = 0;
  int64_t cycles = 0;
  int64_t dummy_cycles = 0;
};

struct RunEndedRecord {
  static constexpr std::string_view kind = "run_ended";
  std::string reason;
  bool schedule_done = false;
  uint64_t tick = 0;
  int64_t cycles = 0;
  int64_t triggers = 0;
  int64_t r_waves = 0;
};

/// Its time is a tick if the controller reported it, else of the host.
struct EventRecord {
  static constexpr std::string_view kind = "event";
  std::optional<uint64_t> tick = {};
  uint64_t host_ns = 0;
  std::string level = {};
  std::string code = {};
  std::string text = {};
};

/// The run was closed in order.
struct EndRecord {
  static constexpr std::string_view kind = "end";
  std::optional<uint64_t> until_ns;  ///< samples that were due at or before that host time belong to the run
};

using Document =
    std::variant<BeginRecord, GridRecord, GapRecord, ClockRecord, InstrumentClockRecord, RunStartedRecord,
                 SegmentRecord, TriggerRecord, SliceRecord, RunEndedRecord, EventRecord, EndRecord>;

struct SampleBlock {
  uint64_t first_index = 0;
  uint32_t channels = 1;
  std::vector<uint64_t> host_ns;  ///< one a sample
  std::vector<double> value_kPa;  ///< row by row
};

struct PositionBlock {
  uint32_t first_index = 0;
  uint64_t first_tick = 0;
  uint32_t period_ticks = 0;
  std::vector<int32_t> microsteps;
};

/// Wrong bytes in texts that are not UTF-8 are replaced.
std::string encode(const Document& document);
std::vector<uint8_t> encode(const SampleBlock& block);
std::vector<uint8_t> encode(const PositionBlock& block);

/// None if the payload is not of a form above.
std::optional<Document> decode_document(std::span<const uint8_t> payload);
std::optional<SampleBlock> decode_samples(std::span<const uint8_t> payload);
std::optional<PositionBlock> decode_positions(std::span<const uint8_t> payload);

/// As JournalWriter::append.
[[nodiscard]] inline bool append(JournalWriter& journal, const Document& document) {
  return journal.append(RecordKind::document, encode(document));
}
[[nodiscard]] inline bool append(JournalWriter& journal, const SampleBlock& block) {
  return journal.append(RecordKind::samples, encode(block));
}
[[nodiscard]] inline bool append(JournalWriter& journal, const PositionBlock& block) {
  return journal.append(RecordKind::positions, encode(block));
}

}  // namespace diastole
