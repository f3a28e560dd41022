#include "host/rig/session_so_far.hpp"

#include <algorithm>
#include <tuple>
#include <vector>

#include "host/journal/journal_store.hpp"
#include "host/runfile/time_axis.hpp"

namespace diastole {
namespace {

/// Until when the journal knows the pump and the pressure, in seconds since the start of run.
double both_streams_until_s(const ParsedJournal& parsed, const TimeAxis& axis) {
  uint64_t pump_tick = parsed.positions ? parsed.positions->last_tick : 0;
  if (parsed.run_ended) pump_tick = std::max(pump_tick, parsed.run_ended->tick);
  return std::min(axis.of_tick(pump_tick), axis.of_host_ns(parsed.last_sample_ns));
}

bool is_whole(const SliceRecord& slice, const ParsedJournal& parsed, const TimeAxis& axis) {
  const int64_t end = slice.cycle + slice.cycles;
  int64_t triggers = 0;
  uint64_t last_tick = 0;
  for (const TriggerRecord& trigger : parsed.triggers) {
    if (trigger.cycle < slice.cycle || trigger.cycle >= end) continue;
    ++triggers;
    last_tick = std::max(last_tick, trigger.tick);
  }
  if (triggers < slice.cycles) return false;
  double end_s = axis.of_tick(last_tick) + parsed.begin.segments.front().period_s;
  if (parsed.run_ended) {
    if (parsed.run_ended->cycles < end) return false;
    end_s = std::min(end_s, axis.of_tick(parsed.run_ended->tick));  // a trigger may come with a delay
  }
  return both_streams_until_s(parsed, axis) + 1 / parsed.begin.sample_rate_Hz >= end_s;
}

}  // namespace

std::set<int64_t> imaged_slices(const ParsedJournal& parsed, const Schedule& schedule) {
  std::set<int64_t> imaged;
  const auto fitted = parsed.start_tick && !parsed.begin.segments.empty()
                          ? fit_clock_map(TimeAxis::controller_pairs(parsed))
                          : std::nullopt;
  if (!fitted) return imaged;
  const TimeAxis axis(parsed, *fitted);
  const std::vector<PlannedSlice> planned = planned_slices(schedule);
  auto next = planned.begin();  // slices are imaged in order; two blocks may have one name
  for (const SliceRecord& slice : parsed.slices) {
    const auto found = std::find_if(next, planned.end(), [&](const PlannedSlice& each) {
      return each.block == slice.block && each.number == slice.slice;
    });
    if (found == planned.end()) continue;
    if (slice.cycles == found->cycles && is_whole(slice, parsed, axis))
      imaged.insert(found - planned.begin());
    next = found + 1;
  }
  return imaged;
}

std::optional<SessionSoFar> last_session(const std::filesystem::path& journal_dir,
                                         const std::string& experiment, const Schedule& schedule) {
  struct Begun {
    BeginRecord begin;
    std::filesystem::path journal;
    std::filesystem::file_time_type written;
  };
  std::vector<Begun> runs;
  std::set<std::string> resumed;
  for (const StoredJournal& stored : stored_journals(journal_dir)) {
    auto begin = read_begin(stored.file);
    if (!begin || begin->experiment != experiment) continue;
    std::error_code ignored;
    resumed.insert(begin->resumes);
    runs.push_back({std::move(*begin), stored.file, std::filesystem::last_write_time(stored.file, ignored)});
  }
  std::erase_if(runs, [&](const Begun& run) { return resumed.contains(run.begin.run_id); });
  const auto newest = std::ranges::max_element(
      runs, {}, [](const Begun& run) { return std::tie(run.begin.started_utc, run.written); });
  if (newest == runs.end()) return std::nullopt;
  SessionSoFar session{newest->begin.run_id, newest->begin.started_utc, newest->journal,
                       imaged_slices(parse_journal(JournalRecords(newest->journal)), schedule)};
  for (const uint64_t slice : newest->begin.slices_done)
    if (slice < static_cast<uint64_t>(schedule.slices())) session.done.insert(static_cast<int64_t>(slice));
  return session;
}

}  // namespace diastole
