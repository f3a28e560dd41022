#include "host/runfile/assemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "host/journal/parsed_journal.hpp"
#include "host/runfile/pressure_rows.hpp"
#include "host/runfile/rows_due.hpp"
#include "host/runfile/time_axis.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"
#include "protocol/signal/zero_phase.hpp"

namespace diastole {
namespace {

using runfile::RecordedRun;

constexpr double mL_per_pL = 1e-9;
constexpr double no_position = std::numeric_limits<double>::quiet_NaN();
const std::string lost_in_the_journal = "its record was lost in the journal";
const std::string not_recorded = "not recorded";

TimeAxis axis_of(const ParsedJournal& parsed, const std::string& file) {
  if (!parsed.start_tick)
    throw NothingRecorded({file, "", "ends before the run started", "There is nothing to recover."});
  const auto fitted = fit_clock_map(TimeAxis::controller_pairs(parsed));
  if (!fitted) {
    throw NothingRecorded({file, "", "ends before the two clocks were compared, so its samples have no time",
                           "There is nothing to recover."});
  }
  return {parsed, *fitted};
}

void declare(std::vector<runfile::Gap>& gaps, std::string_view stream, int64_t first, int64_t count,
             const std::string& reason) {
  if (count <= 0) return;
  if (!gaps.empty()) {
    runfile::Gap& last = gaps.back();
    if (last.stream == stream && last.reason == reason && last.first_index + last.count == first) {
      last.count += count;
      return;
    }
  }
  gaps.push_back({std::string(stream), first, count, reason});
}

/// The rows of /pump, in order; `no_position` where none is known.
class PumpRows {
 public:
  using Take = std::function<void(double time_s, double commanded_mL)>;

  PumpRows(const ParsedJournal& parsed, const TimeAxis& axis, Take take)
      : axis_(axis),
        take_(std::move(take)),
        microstep_mL_(parsed.begin.microstep_pL * mL_per_pL),
        grid_(position_grid(parsed, axis)) {}

  void add(const PositionBlock& block) {
    if (block.first_index < rows_) return;
    const double first_s = axis_.of_tick(block.first_tick);
    const double step_s = axis_.of_tick(block.first_tick + block.period_ticks) - first_s;
    for (; rows_ < block.first_index; ++rows_)
      take_(first_s - step_s * static_cast<double>(block.first_index - rows_), no_position);
    for (size_t i = 0; i < block.microsteps.size(); ++i, ++rows_)
      take_(axis_.of_tick(block.first_tick + i * block.period_ticks), microstep_mL_ * block.microsteps[i]);
  }
  /// The rows that were due but not recorded.
  void finish() {
    if (!grid_) return;
    for (const auto due = static_cast<uint64_t>(grid_->rows()); rows_ < due; ++rows_)
      take_(grid_->start_s + static_cast<double>(rows_) / grid_->rate_Hz, no_position);
  }
  [[nodiscard]] const std::optional<runfile::StreamGrid>& grid() const { return grid_; }

 private:
  const TimeAxis& axis_;
  Take take_;
  double microstep_mL_;
  std::optional<runfile::StreamGrid> grid_;
  uint64_t rows_ = 0;
};

void put_triggers(const ParsedJournal& parsed, const TimeAxis& axis, RecordedRun& run) {
  run.trigger_delay_s = parsed.begin.trigger_delay_s;
  int64_t next_cycle = 0;
  const auto declare_until = [&](int64_t cycle) {
    declare(run.gaps, runfile::trigger_stream, next_cycle, cycle - next_cycle, "its record was lost");
  };
  for (const TriggerRecord& trigger : parsed.triggers) {
    declare_until(trigger.cycle);
    run.trigger_s.push_back(axis.of_tick(trigger.tick));
    next_cycle = trigger.cycle + 1;
  }
  if (parsed.run_ended) declare_until(parsed.run_ended->triggers);
}

/// A segment starts when the controller said so; one that did not begin stands as far behind the last that did
/// as it was planned.
void put_segments(const ParsedJournal& parsed, const TimeAxis& axis, RecordedRun& run) {
  std::map<size_t, double> begun_s;
  for (const SegmentRecord& started : parsed.segment_starts)
    begun_s[started.segment] = axis.of_tick(started.tick);
  double late_s = 0;
  for (const runfile::Segment& planned : parsed.begin.segments) {
    if (const auto begun = begun_s.find(run.segments.size()); begun != begun_s.end()) {
      late_s = begun->second - planned.start_s;
    }
    run.segments.push_back(planned);
    run.segments.back().start_s += late_s;
  }
  // A schedule ends its one segment when the last slice is done; until then the segment had more cycles in reserve.
  if (parsed.run_ended && parsed.run_ended->schedule_done && !run.segments.empty()) {
    run.segments.back().cycles = parsed.run_ended->cycles;
  }
}

/// Rows of the triggers whose cycles belong to a slice.
void put_slices(const ParsedJournal& parsed, RecordedRun& run) {
  const auto row_of = [&](int64_t cycle) {
    const auto at = std::find_if(parsed.triggers.begin(), parsed.triggers.end(),
                                 [&](const TriggerRecord& trigger) { return trigger.cycle >= cycle; });
    return at - parsed.triggers.begin();
  };
  for (const SliceRecord& slice : parsed.slices) {
    const auto first = row_of(slice.cycle);
    run.slices.push_back({slice.block, slice.slice, first, row_of(slice.cycle + slice.cycles) - first,
                          slice.cycles, slice.dummy_cycles});
  }
}

void put_waveforms(const ParsedJournal& parsed, RecordedRun& run) {
  for (const PlayedSegment& played : parsed.begin.waveforms) {
    runfile::PlayedWaveform& waveform = run.waveforms[played.segment];
    waveform = {played.points, {}, played.fraction};
    const double intervals = static_cast<double>(waveform.fraction.size()) - 1;
    for (size_t i = 0; i < waveform.fraction.size(); ++i)
      waveform.phase.push_back(static_cast<double>(i) / intervals);
  }
}

void put_events(const ParsedJournal& parsed, const TimeAxis& axis, RecordedRun& run) {
  for (const EventRecord& event : parsed.events) {
    const double time_s = event.tick ? axis.of_tick(*event.tick) : axis.of_host_ns(event.host_ns);
    run.events.push_back({time_s, event.level, event.code, event.text});
  }
  if (parsed.run_ended && runfile::is_stop_on_request(parsed.run_ended->reason)) {
    run.events.push_back({axis.of_tick(parsed.run_ended->tick), "info", parsed.run_ended->reason,
                          fmt::format("stopped on request after {} cycles", parsed.run_ended->cycles)});
  }
  std::stable_sort(run.events.begin(), run.events.end(),
                   [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
}

/// Offsets are the other clock's reading at the start of run; a positive drift means that it runs fast.
void put_clocks(const ParsedJournal& parsed, const TimeAxis& axis, RecordedRun& run) {
  const double controller_per_host = axis.map().scale;
  run.clock = {{"host_offset_s", axis.host_at_start_s()},
               {"host_drift_ppm", (1 / controller_per_host - 1) * 1e6},
               {"host_residual_s", axis.map().residual_s}};
  if (const auto daq = fit_clock_map(TimeAxis::instrument_pairs(parsed))) {
    run.clock["daq_offset_s"] = daq->to_other_s(axis.host_at_start_s());
    run.clock["daq_drift_ppm"] = (daq->scale / controller_per_host - 1) * 1e6;
  }
}

/// What is known of the rows when all were seen once.
struct Rows {
  uint64_t pump = 0, pressure = 0;
  uint64_t samples_received = 0;
  std::vector<runfile::Gap> pump_gaps, pressure_gaps;
  double first_s = 0, last_s = 0;  ///< of /pressure
  std::optional<runfile::StreamGrid> pump_grid, pressure_grid;

  /// Mean distance of the rows of /pressure; 0 for fewer than two.
  [[nodiscard]] double spacing_s() const {
    return pressure < 2 ? 0 : (last_s - first_s) / static_cast<double>(pressure - 1);
  }
};

/// Throws InputError if they break a rule of runfile::check.
Rows look_through(const JournalRecords& journal, const ParsedJournal& parsed, const TimeAxis& axis) {
  Rows rows;
  runfile::StreamCheck pump_check(journal.file(), runfile::pump_group);
  runfile::StreamCheck pressure_check(journal.file(), runfile::pressure_group);
  const std::string* lost = &lost_in_the_journal;
  PumpRows pump(parsed, axis, [&](double time_s, double commanded_mL) {
    pump_check.time(time_s);
    if (std::isnan(commanded_mL))
      declare(rows.pump_gaps, runfile::pump_stream, static_cast<int64_t>(rows.pump), 1, *lost);
    ++rows.pump;
  });
  PressureRows pressure(parsed, axis, [&](const PressureRow& row) {
    pressure_check.time(row.time_s);
    if (row.missing != nullptr) {
      declare(rows.pressure_gaps, runfile::pressure_stream, static_cast<int64_t>(rows.pressure), 1,
              *row.missing);
    } else {
      for (size_t c = 0; c < row.value_kPa.size(); ++c)
        pressure_check.value(parsed.begin.channels[c] + "_kPa", row.value_kPa[c]);
      ++rows.samples_received;
    }
    if (rows.pressure++ == 0) rows.first_s = row.time_s;
    rows.last_s = row.time_s;
  });
  read_blocks(journal, {[&](const SampleBlock& block) { pressure.add(block); },
                        [&](const PositionBlock& block) { pump.add(block); }});
  lost = &not_recorded;
  pump.finish();
  pressure.finish();
  rows.pump_grid = pump.grid();
  rows.pressure_grid = pressure.grid();
  return rows;
}

/// What the streams need as long as they live.
struct Source {
  JournalRecords journal;
  ParsedJournal parsed;
  TimeAxis axis;
};

/// Hands over each column's values some thousand at a time.
class Columns {
 public:
  Columns(size_t count, const RowStream::Take& take) : take_(take), values_(count) {}
  void put(size_t column, double value) {
    values_[column].push_back(value);
    if (values_[column].size() == block_rows) give(column);
  }
  void finish() {
    for (size_t column = 0; column < values_.size(); ++column)
      give(column);
  }

 private:
  static constexpr size_t block_rows = 4096;
  void give(size_t column) {
    take_(column, values_[column]);
    values_[column].clear();
  }

  const RowStream::Take& take_;
  std::vector<std::vector<double>> values_;
};

RowStream pump_of(const std::shared_ptr<const Source>& source, const Rows& rows) {
  RowStream stream{
      rows.pump,
      {{runfile::pump_time, runfile::time_unit}, {runfile::pump_commanded, runfile::volume_unit}},
      {}};
  stream.each = [source](const RowStream::Take& take) {
    Columns columns(2, take);
    PumpRows pump(source->parsed, source->axis, [&](double time_s, double commanded_mL) {
      columns.put(0, time_s);
      columns.put(1, commanded_mL);
    });
    read_blocks(source->journal, {.positions = [&](const PositionBlock& block) { pump.add(block); }});
    pump.finish();
    columns.finish();
  };
  return stream;
}

RowStream pressure_of(const std::shared_ptr<const Source>& source, const Rows& rows) {
  const std::vector<std::string>& channels = source->parsed.begin.channels;
  RowStream stream{rows.pressure, {{runfile::pressure_time, runfile::time_unit}}, {}};
  for (const std::string& channel : channels)
    stream.columns.push_back(
        {fmt::format("{}/{}_kPa", runfile::pressure_group, channel), runfile::pressure_unit});
  const auto cavity = std::ranges::find(channels, runfile::cavity_channel,
                                        [](const std::string& name) { return name + "_kPa"; });
  const auto design = cavity == channels.end() ? std::nullopt : filter_of(rows.spacing_s());
  if (design) {
    stream.columns.push_back({fmt::format("{}/{}", runfile::pressure_group, runfile::cavity_filtered_channel),
                              runfile::pressure_unit, notes_of(*design)});
  }
  const auto filtered_column = static_cast<size_t>(cavity - channels.begin());
  stream.each = [source, design, filtered_column,
                 count = stream.columns.size()](const RowStream::Take& take) {
    Columns columns(count, take);
    std::optional<signal::ZeroPhaseFilter> filter;
    if (design) filter.emplace(*design, [&](double value_kPa) { columns.put(count - 1, value_kPa); });
    PressureRows pressure(source->parsed, source->axis, [&](const PressureRow& row) {
      columns.put(0, row.time_s);
      for (size_t c = 0; c < row.value_kPa.size(); ++c)
        columns.put(1 + c, row.value_kPa[c]);
      if (filter) filter->push(row.value_kPa[filtered_column]);
    });
    read_blocks(source->journal, {.samples = [&](const SampleBlock& block) { pressure.add(block); }});
    pressure.finish();
    if (filter) filter->end_stretch();
    columns.finish();
  };
  return stream;
}

/// Everything but the rows.
AssembledRun without_rows(const JournalRecords& journal, const ParsedJournal& parsed, const TimeAxis& axis,
                          const Rows& rows) {
  AssembledRun assembled{.run = {},
                         .session = parsed.begin.session,
                         .damage = parsed.damage,
                         .samples_received = rows.samples_received,
                         .samples_missing = rows.pressure - rows.samples_received,
                         .ended_in_order = parsed.closed && parsed.run_ended.has_value()};
  RecordedRun& run = assembled.run;
  run.file = journal.file();
  run.run_id = parsed.begin.run_id;
  run.started_utc = parsed.begin.started_utc;
  run.producer = parsed.begin.producer;
  run.rig = parsed.begin.rig;
  run.protocol_toml = parsed.begin.experiment;
  run.pump.grid = rows.pump_grid;
  run.pressure.grid = rows.pressure_grid;
  put_segments(parsed, axis, run);
  put_waveforms(parsed, run);
  run.gaps = rows.pump_gaps;
  put_triggers(parsed, axis, run);
  run.gaps.insert(run.gaps.end(), rows.pressure_gaps.begin(), rows.pressure_gaps.end());
  put_slices(parsed, run);
  put_events(parsed, axis, run);
  put_clocks(parsed, axis, run);
  if (!assembled.ended_in_order) {
    const double last_s = parsed.closed ? rows.last_s : std::max(rows.last_s, last_known_s(parsed, axis));
    run.events.push_back({last_s, "error", "incomplete", "the recording broke off here"});
  }
  return assembled;
}

}  // namespace

StreamedRun stream_run(const JournalRecords& journal) {
  ParsedJournal parsed = parse_journal(journal);
  const TimeAxis axis = axis_of(parsed, journal.file());
  const auto source = std::make_shared<const Source>(Source{journal, std::move(parsed), axis});
  const Rows rows = look_through(journal, source->parsed, source->axis);
  return {without_rows(journal, source->parsed, source->axis, rows), pump_of(source, rows),
          pressure_of(source, rows)};
}

std::optional<signal::LowPassDesign> filter_of(double spacing_s) {
  if (spacing_s <= 0) return std::nullopt;
  const signal::LowPassDesign design{.rate_Hz = 1 / spacing_s,
                                     .passes = signal::Passes::forward_and_backward};
  if (design.rate_Hz < signal::least_rate_over_cutoff * design.cutoff_Hz) return std::nullopt;
  return design;
}

std::map<std::string, runfile::Attribute, std::less<>> notes_of(const signal::LowPassDesign& design) {
  return {{"filter", std::string("Butterworth low-pass, forward and backward")},
          {"cutoff_Hz", design.cutoff_Hz},
          {"order", int64_t{design.order}},
          {"passes", int64_t{2}},
          {"rate_Hz", design.rate_Hz},
          {"delay_s", 0.0}};
}

}  // namespace diastole
