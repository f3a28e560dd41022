// Arbitrary bytes as a journal, and as the payloads of whole records behind a sound beginning: what is read keeps
// every rule of a run file, or is refused with InputError.
//
//   input: 00 and the bytes of a journal, or
//          records of  kind (1 byte, 1 to 3; others count modulo 3)  length (2 bytes, low one first)  payload

#include <algorithm>
#include <cstdint>
#include <span>
#include <string_view>

#include "host/journal/journal.hpp"
#include "host/journal/parsed_journal.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/host/bench/run_in_memory.hpp"

namespace {

using namespace diastole;

constexpr uint64_t rows_worth_a_try = 100'000;  // more cost time and memory, and no other code

constexpr std::string_view beginning =
    R"({"record":"begin","run_id":"1","started_utc":"2026-01-02T03:04:05Z","producer":"fuzz","experiment":"",
"experiment_file":"x","sample_rate_Hz":300.0,"channels":["cavity"],"rig":{"bore_mm":100.0},"instrument":"i",
"tick_rate_Hz":84000000,"microstep_pL":7790,"daq_timer_rate_Hz":40000000.0,"segments":[{"start_s":0.1,
"waveform":"parabolic","stroke_mL":10.0,"period_s":0.8,"offset_mL":0.0,"cycles":2}]})";

void add(JournalContents& journal, RecordKind kind, std::span<const uint8_t> payload) {
  const auto sequence = static_cast<uint32_t>(journal.records.size());
  journal.records.push_back({kind, sequence, {payload.begin(), payload.end()}});
}

void add(JournalContents& journal, std::string_view document) {
  add(journal, RecordKind::document, {reinterpret_cast<const uint8_t*>(document.data()), document.size()});
}

void assemble(const JournalContents& journal) {
  try {
    const JournalRecords records(journal);
    const ParsedJournal parsed = parse_journal(records);
    uint64_t rows = parsed.sample_rows;
    double planned_s = 0;  // a journal that breaks off may have rows declared until then
    for (const runfile::Segment& segment : parsed.begin.segments)
      planned_s = std::max(planned_s, segment.end_s());
    if (!(planned_s < 60 && parsed.begin.sample_rate_Hz <= 500)) return;
    read_blocks(records, {.positions = [&](const PositionBlock& block) {
                  rows = std::max<uint64_t>(rows, block.first_index);
                  if (500.0 * block.period_ticks < parsed.begin.tick_rate_Hz) rows = rows_worth_a_try + 1;
                }});
    if (rows > rows_worth_a_try) return;
    runfile::check(assemble_run(journal).run);
  } catch (const InputError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::span<const uint8_t> bytes(data, size);
  if (size > 0 && data[0] == 0) {
    assemble(read_journal(bytes.subspan(1)));
    return 0;
  }
  JournalContents journal;
  add(journal, beginning);
  add(journal, R"({"record":"grid","first_due_ns":1000000})");
  add(journal, R"({"record":"clock","host_ns":1000000,"tick":84000,"half_round_trip_ns":1000})");
  add(journal, R"({"record":"run_started","tick":100000})");
  for (size_t at = 0; at + 3 <= size;) {
    const size_t length = std::min<size_t>(data[at + 1] + 256U * data[at + 2], size - at - 3);
    add(journal, static_cast<RecordKind>(1 + (data[at] + 2) % 3), bytes.subspan(at + 3, length));
    at += 3 + length;
  }
  assemble(journal);
  return 0;
}
