#pragma once
// A journal's documents, sorted by kind: the step between records and a run. What grows with the run's length, samples
// and positions, is read in blocks. A record that is not of its form (journal_records.hpp) is left out, as if it had
// been damaged, so that what a run is made of needs no further doubt than `runfile::check`.

#include <functional>

#include "host/journal/journal_records.hpp"

namespace diastole {

/// Of the position stream: its first record, and the newest position.
struct PositionFacts {
  uint32_t first_index = 0;
  uint64_t first_tick = 0;
  uint32_t period_ticks = 0;
  uint64_t last_tick = 0;
};

struct ParsedJournal {
  BeginRecord begin;
  std::optional<uint64_t> first_due_ns;  ///< host time of sample 0, if its record is there
  std::vector<GapRecord> gaps;
  std::vector<ClockRecord> controller_clock;
  std::vector<InstrumentClockRecord> instrument_clock;
  std::optional<uint64_t> start_tick;
  std::vector<SegmentRecord> segment_starts;
  std::vector<TriggerRecord> triggers;
  std::vector<SliceRecord> slices;
  std::vector<EventRecord> events;
  std::optional<RunEndedRecord> run_ended;
  bool closed = false;               ///< the last record says that the run was closed in order
  std::optional<uint64_t> until_ns;  ///< of that record
  std::optional<PositionFacts> positions;
  uint64_t last_sample_ns = 0;  ///< host time

  uint64_t sample_rows = 0;  ///< of the sample stream, missing ones included; at most `most_rows`
  JournalDamage damage;
};

/// What the journal begins with, without reading on; none if that is not whole.
std::optional<BeginRecord> read_begin(const std::filesystem::path& journal);

/// Throws InputError when the journal has no beginning, and as JournalRecords::each.
ParsedJournal parse_journal(const JournalRecords& journal);

/// The blocks of both streams, which a ParsedJournal does not hold. Those of samples come in order of their index,
/// without overlap, and may skip some; those of positions come as they stand. All lie within `most_rows`.
struct BlockTakers {
  std::function<void(const SampleBlock&)> samples = [](const SampleBlock&) {};
  std::function<void(const PositionBlock&)> positions = [](const PositionBlock&) {};
};
void read_blocks(const JournalRecords& journal, const BlockTakers& take);

}  // namespace diastole
