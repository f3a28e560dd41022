#include "host/journal/parsed_journal.hpp"

#include <algorithm>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

/// Puts each document where it belongs.
struct Sorter {
  ParsedJournal& journal;
  bool begun = false;

  void operator()(const BeginRecord& begin) {
    journal.begin = begin;
    begun = true;
  }
  void operator()(const GridRecord& grid) { journal.first_due_ns = grid.first_due_ns; }
  void operator()(const GapRecord& gap) {
    const uint64_t end = gap.first_index + gap.count;
    if (end > most_rows) return;
    journal.sample_rows = std::max(journal.sample_rows, end);
    journal.gaps.push_back(gap);
  }
  void operator()(const ClockRecord& clock) { journal.controller_clock.push_back(clock); }
  void operator()(const InstrumentClockRecord& clock) { journal.instrument_clock.push_back(clock); }
  void operator()(const RunStartedRecord& started) { journal.start_tick = started.tick; }
  void operator()(const SegmentRecord& started) { journal.segment_starts.push_back(started); }
  void operator()(const TriggerRecord& trigger) { journal.triggers.push_back(trigger); }
  void operator()(const SliceRecord& slice) { journal.slices.push_back(slice); }
  void operator()(const RunEndedRecord& ended) { journal.run_ended = ended; }
  void operator()(const EventRecord& event) { journal.events.push_back(event); }
  void operator()(const EndRecord& end) {
    if (end.until_ns) journal.until_ns = end.until_ns;
    journal.closed = true;
  }
};

void follow(const PositionBlock& block, std::optional<PositionFacts>& facts) {
  if (block.microsteps.empty() || block.first_tick > most_ticks) return;
  if (!facts) facts = {block.first_index, block.first_tick, block.period_ticks, 0};
  const uint64_t behind = block.microsteps.size() - 1;
  facts->last_tick = std::max(facts->last_tick, block.first_tick + behind * block.period_ticks);
}

class BlockReader {
 public:
  explicit BlockReader(BlockTakers take) : take_(std::move(take)) {}

  void take(const JournalRecord& record) {
    if (record.kind == RecordKind::samples) {
      if (const auto block = decode_samples(record.payload)) take_samples(*block);
    } else if (record.kind == RecordKind::positions) {
      const auto block = decode_positions(record.payload);
      if (block && uint64_t{block->first_index} + block->microsteps.size() <= most_rows)
        take_.positions(*block);
    }
  }

 private:
  void take_samples(const SampleBlock& block) {
    if (block.first_index < next_sample_ || block.host_ns.empty()) return;
    if (block.first_index + block.host_ns.size() > most_rows || block.first_index > most_rows) return;
    next_sample_ = block.first_index + block.host_ns.size();
    take_.samples(block);
  }

  BlockTakers take_;
  uint64_t next_sample_ = 0;
};

}  // namespace

std::optional<BeginRecord> read_begin(const std::filesystem::path& journal) {
  const auto record = first_record(journal);
  if (!record || record->kind != RecordKind::document) return std::nullopt;
  auto document = decode_document(record->payload);
  auto* begin = document ? std::get_if<BeginRecord>(&*document) : nullptr;
  return begin == nullptr ? std::nullopt : std::optional(std::move(*begin));
}

ParsedJournal parse_journal(const JournalRecords& journal) {
  ParsedJournal parsed;
  Sorter sort{parsed};
  BlockReader blocks({.samples =
                          [&](const SampleBlock& block) {
                            parsed.sample_rows =
                                std::max(parsed.sample_rows, block.first_index + block.host_ns.size());
                            parsed.last_sample_ns = std::max(parsed.last_sample_ns, block.host_ns.back());
                          },
                      .positions = [&](const PositionBlock& block) { follow(block, parsed.positions); }});
  parsed.damage = journal.each([&](const JournalRecord& record) {
    if (record.kind != RecordKind::document) return blocks.take(record);
    if (const auto document = decode_document(record.payload)) std::visit(sort, *document);
  });
  if (!sort.begun) {
    throw InputError({journal.file(), "", "has lost its first record, without which the rest has no meaning",
                      "This journal cannot be recovered."});
  }
  return parsed;
}

void read_blocks(const JournalRecords& journal, const BlockTakers& take) {
  BlockReader blocks(take);
  journal.each([&](const JournalRecord& record) { blocks.take(record); });
}

}  // namespace diastole
