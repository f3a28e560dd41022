#pragma once
// A journal's records, sorted by what they tell; the step between bytes and a run. What grows with the run's length,
// samples and positions, is read in blocks.
//
// A record that is whole by its CRC may still say anything. Whole numbers in it are counts, ticks or nanoseconds
// within the bounds below, rates are positive; a record that is not of its form (journal_records.hpp) is left out, as
// if it had been damaged, so that what a run is made of needs no further doubt than `runfile::check`.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/acquisition/journal.hpp"
#include "host/acquisition/journal_records.hpp"
#include "host/controller/clock_map.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {

/// More rows than a stream of any session has: 37 hours at 1 kHz. Memory is taken for every row up to the last.
inline constexpr uint64_t most_rows = uint64_t{1} << 27;

struct PlayedSegment {
  size_t segment = 0;
  std::string points;
  std::vector<double> fraction;
};

/// What was known before the start.
struct Beginning {
  std::string run_id;
  std::string started_utc;
  std::string producer;
  std::string experiment;       ///< its text
  std::string experiment_file;  ///< where that text stood
  double sample_rate_Hz = 1;
  double tick_rate_Hz = 1;
  double daq_timer_rate_Hz = 1;
  bool daq_timer_counts_samples = false;
  double microstep_pL = 0;
  double trigger_delay_s = 0;
  std::vector<std::string> channels;
  std::map<std::string, runfile::Attribute, std::less<>> rig;
  std::vector<runfile::Segment> segments;  ///< as planned
  std::vector<PlayedSegment> waveforms;
};

struct DeclaredGap {
  uint64_t first_index = 0;
  uint64_t count = 0;
  std::string reason;
};

struct SegmentStart {
  size_t segment = 0;
  uint64_t tick = 0;
};

struct RaisedTrigger {
  int64_t cycle = 0;
  uint64_t tick = 0;
};

struct BegunSlice {
  std::string block;
  int64_t slice = 0;
  int64_t cycle = 0;
  int64_t cycles = 0;
  int64_t dummy_cycles = 0;
};

/// Its time is a tick if the controller told it, else of the host.
struct NotedEvent {
  std::optional<uint64_t> tick = {};
  uint64_t host_ns = 0;
  std::string level = {};
  std::string code = {};
  std::string text = {};
};

struct EndOfRun {
  std::string reason;
  bool schedule_done = false;
  uint64_t tick = 0;
  int64_t cycles = 0;
  int64_t triggers = 0;
};

/// Of the position stream: its first record, and the newest position.
struct PositionFacts {
  uint32_t first_index = 0;
  uint64_t first_tick = 0;
  uint32_t period_ticks = 0;
  uint64_t last_tick = 0;
};

struct JournalStory {
  Beginning begin;
  std::optional<uint64_t> first_due_ns;  ///< host time of sample 0, if its record is there
  std::vector<DeclaredGap> gaps;
  std::vector<ClockPair> controller_pairs;  ///< other = controller ticks / tick rate
  std::vector<ClockPair> daq_pairs;         ///< other = instrument timer / its rate, unwrapped
  std::optional<uint64_t> start_tick;
  std::vector<SegmentStart> segment_starts;
  std::vector<RaisedTrigger> triggers;
  std::vector<BegunSlice> slices;
  std::vector<NotedEvent> events;
  std::optional<EndOfRun> run_ended;
  bool closed = false;               ///< the last record says that the run was closed in order
  std::optional<uint64_t> until_ns;  ///< host time up to which samples were due; told by that record
  std::optional<PositionFacts> positions;
  uint64_t last_sample_ns = 0;  ///< host time

  uint64_t sample_rows = 0;  ///< of the sample stream, missing ones included; at most `most_rows`
  JournalDamage damage;
};

/// Throws InputError when the journal has no beginning, and as JournalRecords::each.
JournalStory read_story(const JournalRecords& journal);

/// The blocks of both streams, which a story does not hold. Those of samples come in order of their index, without
/// overlap, and may skip some; those of positions come as they stand. All lie within `most_rows`.
struct BlockTakers {
  std::function<void(const SampleBlock&)> samples = [](const SampleBlock&) {};
  std::function<void(const PositionBlock&)> positions = [](const PositionBlock&) {};
};
void read_blocks(const JournalRecords& journal, const BlockTakers& take);

}  // namespace diastole
