#include "host/runfile/assemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "host/runfile/filtered_channel.hpp"
#include "host/runfile/journal_story.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/soundness.hpp"

namespace diastole {
namespace {

using runfile::RecordedRun;

constexpr double ns_per_s = 1e9;
constexpr double mL_per_pL = 1e-9;
constexpr double missing = std::numeric_limits<double>::quiet_NaN();
const std::string lost_in_the_journal = "its record was lost in the journal";

/// Controller ticks and host times as seconds since the start of run.
class TimeAxis {
 public:
  TimeAxis(const JournalStory& story, const std::string& file)
      : tick_rate_Hz_(story.begin.tick_rate_Hz), start_tick_(*story.start_tick) {
    const auto fitted = fit_clock_map(story.controller_pairs);
    if (!fitted) {
      throw NothingRecorded({file, "",
                             "ends before the two clocks were compared, so its samples have no time",
                             "There is nothing to recover."});
    }
    map_ = *fitted;
  }

  [[nodiscard]] double of_tick(uint64_t tick) const {
    const double ticks = tick >= start_tick_ ? static_cast<double>(tick - start_tick_)
                                             : -static_cast<double>(start_tick_ - tick);
    return ticks / tick_rate_Hz_;
  }
  [[nodiscard]] double of_host_ns(uint64_t host_ns) const {
    return of_host_s(static_cast<double>(host_ns) / ns_per_s);
  }
  [[nodiscard]] double of_host_s(double host_s) const { return map_.to_other_s(host_s) - start_s(); }
  [[nodiscard]] double host_at_start_s() const { return map_.to_host_s(start_s()); }
  [[nodiscard]] const ClockMap& map() const { return map_; }

 private:
  [[nodiscard]] double start_s() const { return static_cast<double>(start_tick_) / tick_rate_Hz_; }

  double tick_rate_Hz_;
  uint64_t start_tick_;
  ClockMap map_;
};

/// One row of the sample grid before cutting: its index is its place.
struct Grid {
  std::vector<double> time_s;  // NaN: missing
  std::vector<std::vector<double>> channels;
  std::vector<uint32_t> reason;  // why it is missing: its place in `reasons`
  std::vector<std::string> reasons;
};

/// When sample k was taken: as the host noted; if the instrument's timer counts its samples, as that timer's line
/// against the host's clock tells, which knows nothing of blocks and how late they came.
class SampleTimes {
 public:
  SampleTimes(const JournalStory& story, const TimeAxis& axis) : axis_(axis) {
    if (!story.begin.daq_timer_counts_samples) return;
    rate_Hz_ = story.begin.sample_rate_Hz;
    map_ = fit_clock_map(story.daq_pairs);
  }

  [[nodiscard]] double of(uint64_t index, uint64_t host_ns) const {
    if (!map_) return axis_.of_host_ns(host_ns);
    return axis_.of_host_s(map_->to_host_s(static_cast<double>(index) / rate_Hz_));
  }

 private:
  const TimeAxis& axis_;
  double rate_Hz_ = 1;
  std::optional<ClockMap> map_;
};

Grid lay_out(const JournalStory& story, const TimeAxis& axis, size_t channels) {
  const SampleTimes times(story, axis);
  const uint64_t rows = story.sample_rows();
  Grid grid{std::vector<double>(rows, missing),
            std::vector<std::vector<double>>(channels, std::vector<double>(rows, missing)),
            std::vector<uint32_t>(rows, 0),
            {lost_in_the_journal}};
  for (const DeclaredGap& gap : story.gaps) {
    std::fill_n(grid.reason.begin() + static_cast<std::ptrdiff_t>(gap.first_index), gap.count,
                static_cast<uint32_t>(grid.reasons.size()));
    grid.reasons.push_back(gap.reason);
  }
  for (const SampleBlock& block : story.samples) {
    if (block.channels != channels) continue;
    for (size_t i = 0; i < block.host_ns.size(); ++i) {
      const size_t row = block.first_index + i;
      grid.time_s[row] = times.of(row, block.host_ns[i]);
      for (size_t c = 0; c < channels; ++c)
        grid.channels[c][row] = block.value_kPa[i * channels + c];
    }
  }
  return grid;
}

/// When row 0 was due: as the journal tells; else as its first sample tells; else the start of run, before
/// which the grid begins by some milliseconds.
double grid_start_s(const JournalStory& story, const TimeAxis& axis, const std::vector<double>& time_s,
                    double spacing_s) {
  if (story.first_due_ns) return axis.of_host_ns(*story.first_due_ns);
  const auto first = std::find_if(time_s.begin(), time_s.end(), [](double t) { return !std::isnan(t); });
  if (first == time_s.end()) return 0;
  return *first - spacing_s * static_cast<double>(first - time_s.begin());
}

/// Gives missing rows times evenly between their neighbours; before the first and after the last sample that
/// was received, the times at which they were due. As the last one may have come later than the next was due,
/// a row lies at least a tenth of the spacing after the one before.
void fill_times(std::vector<double>& time_s, double start_s, double spacing_s) {
  const size_t rows = time_s.size();
  const auto due_s = [&](size_t row) { return start_s + spacing_s * static_cast<double>(row); };
  size_t row = 0;
  for (; row < rows && std::isnan(time_s[row]); ++row)
    time_s[row] = due_s(row);
  while (row < rows) {
    size_t next = row + 1;
    while (next < rows && std::isnan(time_s[next]))
      ++next;
    for (size_t i = row + 1; i < next; ++i) {
      time_s[i] = next < rows
                      ? time_s[i - 1] + (time_s[next] - time_s[i - 1]) / static_cast<double>(next - i + 1)
                      : std::max(due_s(i), time_s[i - 1] + 0.1 * spacing_s);
    }
    row = next;
  }
}

void declare(RecordedRun& run, std::string_view stream, int64_t first, int64_t count,
             const std::string& reason) {
  if (count <= 0) return;
  if (!run.gaps.empty()) {
    runfile::Gap& last = run.gaps.back();
    if (last.stream == stream && last.reason == reason && last.first_index + last.count == first) {
      last.count += count;
      return;
    }
  }
  run.gaps.push_back({std::string(stream), first, count, reason});
}

void put_pressure(const JournalStory& story, const TimeAxis& axis, AssembledRun& assembled) {
  RecordedRun& run = assembled.run;
  const std::vector<std::string>& names = story.begin.channels;
  const double spacing_s = axis.map().scale / story.begin.sample_rate_Hz;
  Grid grid = lay_out(story, axis, names.size());
  std::vector<bool> received;
  for (const double t : grid.time_s)
    received.push_back(!std::isnan(t));
  fill_times(grid.time_s, grid_start_s(story, axis, grid.time_s, spacing_s), spacing_s);
  const auto first = std::lower_bound(grid.time_s.begin(), grid.time_s.end(), 0.0) - grid.time_s.begin();
  const auto last = std::ssize(grid.time_s);
  const auto keep = [first](std::vector<double>& values) {
    values.erase(values.begin(), values.begin() + first);
    return std::move(values);
  };
  run.pressure.time_s = keep(grid.time_s);
  for (size_t c = 0; c < names.size(); ++c)
    run.pressure.channels[names[c] + "_kPa"] = keep(grid.channels[c]);
  for (auto row = first; row < last; ++row) {
    if (received[static_cast<size_t>(row)]) {
      ++assembled.samples_received;
    } else {
      ++assembled.samples_missing;
      declare(run, runfile::pressure_stream, row - first, 1,
              grid.reasons[grid.reason[static_cast<size_t>(row)]]);
    }
  }
}

void put_positions(const JournalStory& story, const TimeAxis& axis, RecordedRun& run) {
  const double microstep_mL = story.begin.microstep_pL * mL_per_pL;
  for (const PositionBlock& block : story.positions) {
    if (block.first_index < run.pump.time_s.size()) continue;
    const double step_s =
        axis.of_tick(block.first_tick + block.period_ticks) - axis.of_tick(block.first_tick);
    const double first_s = axis.of_tick(block.first_tick);
    while (run.pump.time_s.size() < block.first_index) {
      const size_t row = run.pump.time_s.size();
      declare(run, runfile::pump_stream, static_cast<int64_t>(row), 1, lost_in_the_journal);
      run.pump.time_s.push_back(first_s - step_s * static_cast<double>(block.first_index - row));
      run.pump.commanded_mL.push_back(missing);
    }
    for (size_t i = 0; i < block.microsteps.size(); ++i) {
      run.pump.time_s.push_back(axis.of_tick(block.first_tick + i * block.period_ticks));
      run.pump.commanded_mL.push_back(microstep_mL * block.microsteps[i]);
    }
  }
}

void put_triggers(const JournalStory& story, const TimeAxis& axis, RecordedRun& run) {
  run.trigger_delay_s = story.begin.trigger_delay_s;
  int64_t next_cycle = 0;
  const auto declare_until = [&](int64_t cycle) {
    declare(run, runfile::trigger_stream, next_cycle, cycle - next_cycle, "its record was lost");
  };
  for (const RaisedTrigger& trigger : story.triggers) {
    declare_until(trigger.cycle);
    run.trigger_s.push_back(axis.of_tick(trigger.tick));
    next_cycle = trigger.cycle + 1;
  }
  if (story.run_ended) declare_until(story.run_ended->triggers);
}

/// A segment starts when the controller said so; one that did not begin stands as far behind the last that did
/// as it was planned.
void put_segments(const JournalStory& story, const TimeAxis& axis, RecordedRun& run) {
  std::map<size_t, double> begun_s;
  for (const SegmentStart& started : story.segment_starts)
    begun_s[started.segment] = axis.of_tick(started.tick);
  double late_s = 0;
  for (const runfile::Segment& planned : story.begin.segments) {
    if (const auto begun = begun_s.find(run.segments.size()); begun != begun_s.end()) {
      late_s = begun->second - planned.start_s;
    }
    run.segments.push_back(planned);
    run.segments.back().start_s += late_s;
  }
  // A schedule ends its one segment when the last slice is done; until then the segment had more cycles in reserve.
  if (story.run_ended && story.run_ended->schedule_done && !run.segments.empty()) {
    run.segments.back().cycles = story.run_ended->cycles;
  }
}

/// Rows of the triggers whose cycles belong to a slice.
void put_slices(const JournalStory& story, RecordedRun& run) {
  const auto row_of = [&](int64_t cycle) {
    const auto at = std::find_if(story.triggers.begin(), story.triggers.end(),
                                 [&](const RaisedTrigger& trigger) { return trigger.cycle >= cycle; });
    return at - story.triggers.begin();
  };
  for (const BegunSlice& slice : story.slices) {
    const auto first = row_of(slice.cycle);
    run.slices.push_back({slice.block, slice.slice, first, row_of(slice.cycle + slice.cycles) - first,
                          slice.cycles, slice.dummy_cycles});
  }
}

void put_waveforms(const JournalStory& story, RecordedRun& run) {
  for (const PlayedSegment& played : story.begin.waveforms) {
    runfile::PlayedWaveform& waveform = run.waveforms[played.segment];
    waveform = {played.points, {}, played.fraction};
    const double intervals = static_cast<double>(waveform.fraction.size()) - 1;
    for (size_t i = 0; i < waveform.fraction.size(); ++i)
      waveform.phase.push_back(static_cast<double>(i) / intervals);
  }
}

void put_events(const JournalStory& story, const TimeAxis& axis, RecordedRun& run) {
  for (const NotedEvent& event : story.events) {
    const double time_s = event.tick ? axis.of_tick(*event.tick) : axis.of_host_ns(event.host_ns);
    run.events.push_back({time_s, event.level, event.code, event.text});
  }
  if (story.run_ended && runfile::is_stop_on_request(story.run_ended->reason)) {
    run.events.push_back({axis.of_tick(story.run_ended->tick), "info", story.run_ended->reason,
                          fmt::format("stopped on request after {} cycles", story.run_ended->cycles)});
  }
  std::stable_sort(run.events.begin(), run.events.end(),
                   [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
}

/// Offsets are the other clock's reading at the start of run; a positive drift means that it runs fast.
void put_clocks(const JournalStory& story, const TimeAxis& axis, RecordedRun& run) {
  const double controller_per_host = axis.map().scale;
  run.clock = {{"host_offset_s", axis.host_at_start_s()},
               {"host_drift_ppm", (1 / controller_per_host - 1) * 1e6},
               {"host_residual_s", axis.map().residual_s}};
  if (const auto daq = fit_clock_map(story.daq_pairs)) {
    run.clock["daq_offset_s"] = daq->to_other_s(axis.host_at_start_s());
    run.clock["daq_drift_ppm"] = (daq->scale / controller_per_host - 1) * 1e6;
  }
}

}  // namespace

AssembledRun assemble_run(const JournalContents& journal) {
  const JournalStory story = read_story(journal);
  if (!story.start_tick) {
    throw NothingRecorded({journal.file, "", "ends before the run started", "There is nothing to recover."});
  }
  const TimeAxis axis(story, journal.file);
  AssembledRun assembled;
  RecordedRun& run = assembled.run;
  run.file = journal.file;
  run.run_id = story.begin.run_id;
  run.started_utc = story.begin.started_utc;
  run.producer = story.begin.producer;
  run.rig = story.begin.rig;
  run.protocol_toml = story.begin.experiment;
  put_segments(story, axis, run);
  put_waveforms(story, run);
  put_positions(story, axis, run);
  put_triggers(story, axis, run);
  put_slices(story, run);
  put_events(story, axis, run);
  put_clocks(story, axis, run);
  put_pressure(story, axis, assembled);
  add_filtered_channel(run.pressure);
  assembled.ended_in_order = story.closed && story.run_ended.has_value();
  if (!assembled.ended_in_order) {
    const double last_s = run.pressure.time_s.empty() ? 0 : run.pressure.time_s.back();
    run.events.push_back({last_s, "error", "incomplete", "the recording broke off here"});
  }
  return assembled;
}

}  // namespace diastole
