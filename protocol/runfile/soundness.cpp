#include "protocol/runfile/soundness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "protocol/runfile/cycles.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/signal/saturation.hpp"

namespace diastole::runfile {
namespace {

constexpr size_t most_remarks = 5;  // reported one by one, for each segment

StreamFacts facts_of(const RecordedRun& run, const std::optional<StreamGrid>& grid, const StreamRows& rows,
                     std::string_view stream) {
  StreamFacts facts;
  facts.rows = rows.time_s.size();
  if (grid) facts.expected = grid->rows();
  for (const Gap& gap : run.gaps) {
    if (gap.stream.starts_with(stream)) facts.missing += gap.count;
  }
  if (rows.spacing().median_s > 0) facts.rate_Hz = 1 / rows.spacing().median_s;
  facts.irregularity = rows.spacing().irregularity;
  return facts;
}

void look_for_holes(const StreamRows& rows, std::string_view stream, std::vector<std::string>& problems) {
  const std::vector<Hole>& holes = rows.spacing().holes;
  if (holes.empty()) return;
  const Hole& first = holes.front();
  problems.push_back(fmt::format(
      "{}: {:.1f} ms without a sample before index {}, not declared as a gap{}", stream,
      1e3 * (first.after_s - first.before_s), first.row,
      holes.size() > 1 ? fmt::format(", and {} more such holes", holes.size() - 1) : std::string()));
}

/// A stream must reach from the start of run to its end, and have the rows that were due.
void look_at_ends(const StreamFacts& facts, const Spacing& spacing, std::string_view stream, double end_s,
                  std::vector<std::string>& problems) {
  if (facts.expected && *facts.expected != static_cast<int64_t>(facts.rows)) {
    problems.push_back(
        fmt::format("{}: {} rows, but {} were due by the clocks", stream, facts.rows, *facts.expected));
  }
  if (facts.rows == 0 || facts.rate_Hz <= 0) return;
  const double reach_s = reach_spacings / facts.rate_Hz;
  if (spacing.first_s > reach_s) {
    problems.push_back(fmt::format("{}: {:.3f} s without a sample before index 0, not declared as a gap",
                                   stream, spacing.first_s));
  }
  if (spacing.last_s < end_s - reach_s) {
    problems.push_back(
        fmt::format("{}: ends at {:.3f} s, the run at {:.3f} s; what is between is not declared as a gap",
                    stream, spacing.last_s, end_s));
  }
}

/// The triggers of each segment against its cycles; a hold may have been triggered or not.
void check_triggers(const RecordedRun& run, size_t number, Soundness& soundness) {
  const SegmentTriggers found = triggers_of(run, number);
  const bool untriggered_hold = run.segments[number].waveform == "hold" && found.triggers.empty();
  if (untriggered_hold) return;
  TriggerCounts& counts = soundness.triggers;
  counts.scheduled += found.scheduled;
  counts.missing += found.count(TriggerFault::missing);
  counts.extra += found.count(TriggerFault::extra);
  counts.non_periodic += found.count(TriggerFault::non_periodic);
  if (found.remarks.empty()) return;
  soundness.problems.push_back(
      fmt::format("segment {}: {} triggers for {} cycles: {} missing, {} extra, {} not periodic", number,
                  found.triggers.size(), found.scheduled, found.count(TriggerFault::missing),
                  found.count(TriggerFault::extra), found.count(TriggerFault::non_periodic)));
  for (size_t i = 0; i < std::min(most_remarks, found.remarks.size()); ++i)
    soundness.problems.push_back(fmt::format("segment {}: {}", number, found.remarks[i].text));
  if (found.remarks.size() > most_remarks) {
    soundness.problems.push_back(
        fmt::format("segment {}: and {} more such triggers", number, found.remarks.size() - most_remarks));
  }
}

void check_triggers_outside(const RecordedRun& run, Soundness& soundness) {
  const std::vector<size_t> rows = triggers_outside(run);
  soundness.triggers.extra += std::ssize(rows);
  for (size_t i = 0; i < std::min(most_remarks, rows.size()); ++i) {
    soundness.problems.push_back(
        fmt::format("trigger {}: at {:.3f} s, outside every segment", rows[i], run.trigger_s[rows[i]]));
  }
  if (rows.size() > most_remarks) {
    soundness.problems.push_back(
        fmt::format("trigger {} and others: outside every segment", rows[most_remarks]));
  }
}

void check_slices(const RecordedRun& run, Soundness& soundness) {
  for (const Slice& slice : run.slices) {
    if (slice.triggers == slice.cycles || soundness.stopped_on_request) continue;
    soundness.problems.push_back(fmt::format("slice {} of {}: {} of its {} cycles were triggered",
                                             slice.number, slice.block, slice.triggers, slice.cycles));
  }
}

void check_clocks(const RecordedRun& run, Soundness& soundness) {
  for (const auto& [name, value] : run.clock) {
    if (!name.ends_with("_drift_ppm") || std::abs(value) <= plausible_drift_ppm) continue;
    soundness.problems.push_back(
        fmt::format("clock: {} is {:.0f}; clocks differ by tens of ppm, so the samples' times are in doubt",
                    name, value));
  }
}

/// The ends of the instrument's range are looked for in what was measured, not in what was made of it by a filter.
void look_at_values(const StreamRows& rows, Soundness& soundness) {
  for (const auto& [name, values_kPa] : rows.values) {
    signal::SaturationWatch watch;
    values_kPa.each_block([&](size_t, std::span<const double> block) {
      for (const double value_kPa : block)
        watch.push(value_kPa);
    });
    watch.finish();
    soundness.ranges[name] = {watch.least().value, watch.most().value};
    if (name.ends_with("_filtered_kPa")) continue;
    soundness.saturated[name] = watch.samples();
    if (watch.stands_still())
      soundness.problems.push_back(fmt::format(
          "pressure/{} stands at {:.3f} kPa throughout: nothing is connected, or the pressure was beyond the "
          "instrument's range",
          name, watch.most().value));
    for (const signal::Saturated& end : {watch.least(), watch.most()}) {
      if (end.samples == 0) continue;
      soundness.problems.push_back(
          fmt::format("pressure/{}: {} samples in {} stretches stand at {:.3f} kPa, where the instrument's "
                      "range ends: the "
                      "pressure was beyond it",
                      name, end.samples, end.runs, end.value));
    }
  }
}

}  // namespace

bool is_stop_on_request(std::string_view code) {
  return code == "stopped_at_cycle_end" || code == "stopped_now";
}

bool was_stopped_on_request(const RecordedRun& run) {
  return std::ranges::any_of(run.events, [](const Event& event) { return is_stop_on_request(event.code); });
}

double end_of_motion_s(const RecordedRun& run) {
  double end_s = 0;
  for (const Segment& segment : run.segments)
    end_s = std::max(end_s, segment.end_s());
  for (const Event& event : run.events) {
    if (event.level == "error" || is_stop_on_request(event.code)) end_s = std::min(end_s, event.time_s);
  }
  return end_s;
}

Soundness assess(const RecordedRun& run) { return assess(run, rows_of(run)); }

Soundness assess(const RecordedRun& run, const RunRows& rows) {
  Soundness soundness;
  auto& problems = soundness.problems;
  const Spacing& pressure = rows.pressure.spacing();
  soundness.pressure = facts_of(run, run.pressure.grid, rows.pressure, pressure_stream);
  soundness.pump = facts_of(run, run.pump.grid, rows.pump, pump_stream);
  if (!soundness.pressure.any()) problems.emplace_back("no pressure was recorded");
  if (soundness.pump.rows == 0) problems.emplace_back("no position of the pump was recorded");
  soundness.duration_s = pressure.last_s - pressure.first_s;
  for (const Gap& gap : run.gaps) {
    problems.push_back(fmt::format("{}: {} missing from index {} on: {}", gap.stream, gap.count,
                                   gap.first_index, gap.reason));
  }
  soundness.stopped_on_request = was_stopped_on_request(run);
  look_for_holes(rows.pressure, pressure_stream, problems);
  look_for_holes(rows.pump, pump_stream, problems);
  const double end_s = end_of_motion_s(run);
  const double period_s = run.segments.empty() ? 0 : run.segments.back().period_s;
  look_at_ends(soundness.pressure, pressure, pressure_stream, end_s, problems);
  look_at_ends(soundness.pump, rows.pump.spacing(), pump_stream, end_s - last_step_periods * period_s,
               problems);
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const Segment& segment = run.segments[i];
    (segment.waveform == "hold" ? soundness.scheduled_holds : soundness.scheduled_cycles) += segment.cycles;
    check_triggers(run, i, soundness);
  }
  check_triggers_outside(run, soundness);
  check_slices(run, soundness);
  check_clocks(run, soundness);
  look_at_values(rows.pressure, soundness);
  for (const Event& event : run.events) {
    if (event.level == "error") {
      problems.push_back(fmt::format("at {:.3f} s: {}: {}", event.time_s, event.code, event.text));
    }
  }
  return soundness;
}

}  // namespace diastole::runfile
