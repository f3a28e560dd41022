#include "host/config/schedule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace diastole {
namespace {

constexpr NumberRange count{.at_least = 1, .at_most = 1'000'000};
constexpr NumberRange count_or_none{.at_least = 0, .at_most = 1'000'000};

int64_t read_cycles_per_slice(TableReader& table) {
  if (!table.has("lines")) return table.integer("cycles_per_slice", count);
  if (table.has("cycles_per_slice")) {
    table.fail("cycles_per_slice", "is given beside lines, which tells it", "Keep one of them.");
  }
  const int64_t lines = table.integer("lines", count);
  const int64_t lines_per_segment = table.integer("lines_per_segment", count);
  return (lines + lines_per_segment - 1) / lines_per_segment * table.integer_or("averages", 1, count);
}

/// The scanner's frames must lie within the cycles between two gates.
std::optional<PlannedFrames> read_frames(TableReader& table, double interval_s) {
  if (!table.has("frames")) return std::nullopt;
  const PlannedFrames planned{.frames = table.integer("frames", {.at_least = 1, .at_most = 10'000}),
                              .first_ms = table.number_or("first_ms", 0, {.at_least = 0, .at_most = 1e6}),
                              .tr_ms = table.number("tr_ms", {.above = 0, .at_most = 1e6})};
  const auto frames = static_cast<double>(planned.frames);
  const double end_s = 1e-3 * (planned.first_ms + frames * planned.tr_ms);
  if (end_s <= interval_s + 1e-9) return planned;
  table.fail(
      "frames",
      fmt::format(
          "{:g} frames of {:g} ms end {:g} s after the trigger, but the scanner is triggered every {:g} s",
          frames, planned.tr_ms, end_s, interval_s),
      "Take fewer or shorter frames, lengthen period_s, or let the scanner take every n-th R-wave "
      "(gate_every).");
}

ScheduleBlock read_block(TableReader table, double period_s) {
  ScheduleBlock block;
  block.name = table.text("name");
  block.slices = table.integer_or("slices", 1, count);
  block.cycles_per_slice = read_cycles_per_slice(table);
  block.prompt = table.text_or("prompt", "");
  block.gate_every = table.integer_or("gate_every", 1, count);
  block.frames = read_frames(table, period_s * static_cast<double>(block.gate_every));
  table.finish();
  return block;
}

/// Of a block whose first slice has that number of all.
int64_t slices_due(const ScheduleBlock& block, int64_t first, const std::set<int64_t>& done) {
  return block.slices - std::distance(done.lower_bound(first), done.lower_bound(first + block.slices));
}

}  // namespace

bool Schedule::waits() const {
  int64_t first = 0;
  return std::ranges::any_of(blocks, [&](const ScheduleBlock& block) {
    const bool due = slices_due(block, std::exchange(first, first + block.slices), done) > 0;
    return due && !block.prompt.empty();
  });
}

int64_t Schedule::slices() const {
  int64_t total = 0;
  for (const ScheduleBlock& block : blocks)
    total += block.slices;
  return total;
}

int64_t Schedule::cycles() const {
  int64_t total = 0, due = 0, first = 0;
  for (const ScheduleBlock& block : blocks) {
    const int64_t due_here = slices_due(block, std::exchange(first, first + block.slices), done);
    total += due_here * (dummy_cycles + block.cycles_per_slice);
    due += due_here;
  }
  return total + std::max<int64_t>(0, due - 1) * pause_cycles;
}

std::vector<PlannedSlice> planned_slices(const Schedule& schedule) {
  std::vector<PlannedSlice> slices;
  for (const ScheduleBlock& block : schedule.blocks) {
    for (int64_t number = 0; number < block.slices; ++number) {
      slices.push_back({block.name, number, schedule.dummy_cycles, block.cycles_per_slice,
                        schedule.pause_cycles, block.prompt, schedule.done.contains(std::ssize(slices))});
    }
  }
  const auto last_due =
      std::find_if(slices.rbegin(), slices.rend(), [](const auto& slice) { return !slice.done; });
  if (last_due != slices.rend()) last_due->pause_cycles = 0;
  return slices;
}

Schedule read_schedule(TableReader table, double period_s) {
  Schedule schedule;
  schedule.dummy_cycles = table.integer_or("dummy_cycles", 0, count_or_none);
  schedule.pause_cycles = table.integer_or("pause_cycles", 0, count_or_none);
  schedule.wait_cycles_at_most = table.integer_or("wait_cycles_at_most", 3000, count);
  for (TableReader& block : table.tables("block"))
    schedule.blocks.push_back(read_block(std::move(block), period_s));
  if (schedule.blocks.empty()) table.fail("block", "is missing", "Add at least one [[schedule.block]].");
  if (schedule.cycles_at_most() > 10'000'000) {
    table.fail("block", fmt::format("blocks ask for {} cycles in all", schedule.cycles_at_most()),
               "The controller counts 10000000 in a segment: split the study.");
  }
  table.finish();
  return schedule;
}

std::optional<Schedule> schedule_of(std::string_view experiment, const std::string& file) {
  TableReader root = TableReader::from_text(experiment, file);
  auto table = root.table_if("schedule");
  std::vector<TableReader> segments = root.tables("segment");
  if (!table || segments.empty()) return std::nullopt;
  return read_schedule(std::move(*table), segments.front().number("period_s"));
}

}  // namespace diastole
