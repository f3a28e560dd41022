#include "host/runfile/rows_due.hpp"

#include <algorithm>
#include <cmath>

#include "host/acquisition/sample_source.hpp"

namespace diastole {
namespace {

/// The acquisition breaks a run off that goes on much longer than its segments.
double longest_s(const ParsedJournal& parsed) {
  constexpr double ramps_s = 120;
  double end_s = 0;
  for (const runfile::Segment& segment : parsed.begin.segments)
    end_s = std::max(end_s, segment.end_s());
  return end_s + ramps_s;
}

}  // namespace

double last_known_s(const ParsedJournal& parsed, const TimeAxis& axis) {
  double last_s = axis.of_host_ns(parsed.last_sample_ns);
  const auto tick = [&](uint64_t at) { last_s = std::max(last_s, axis.of_tick(at)); };
  if (parsed.positions) tick(parsed.positions->last_tick);
  if (parsed.run_ended) tick(parsed.run_ended->tick);
  for (const SegmentRecord& started : parsed.segment_starts)
    tick(started.tick);
  for (const TriggerRecord& trigger : parsed.triggers)
    tick(trigger.tick);
  for (const EventRecord& event : parsed.events)
    last_s = std::max(last_s, event.tick ? axis.of_tick(*event.tick) : axis.of_host_ns(event.host_ns));
  const auto compared = [&](const auto& clock) { last_s = std::max(last_s, axis.of_host_ns(clock.host_ns)); };
  std::ranges::for_each(parsed.controller_clock, compared);
  std::ranges::for_each(parsed.instrument_clock, compared);
  return std::clamp(last_s, 0.0, longest_s(parsed));
}

uint64_t rows_due_by(double time_s, double start_s, double spacing_s) {
  const double rows = std::floor((time_s - start_s) / spacing_s) + 1;
  return rows > 0 ? static_cast<uint64_t>(std::min(rows, static_cast<double>(most_rows))) : 0;
}

std::optional<uint64_t> samples_due(const ParsedJournal& parsed) {
  if (!parsed.closed || !parsed.until_ns || !parsed.first_due_ns) return std::nullopt;
  const SampleGrid grid{*parsed.first_due_ns, parsed.begin.sample_rate_Hz};
  const double span_ns = static_cast<double>(*parsed.until_ns) - static_cast<double>(grid.first_due_ns);
  if (span_ns * grid.rate_Hz >= ns_per_s * static_cast<double>(most_rows)) return std::nullopt;
  return grid.due_by(*parsed.until_ns);
}

std::optional<runfile::StreamGrid> position_grid(const ParsedJournal& parsed, const TimeAxis& axis) {
  if (!parsed.positions || (parsed.closed && !parsed.run_ended)) return std::nullopt;
  constexpr double rounding = 1e-3;  // of a spacing: both ends are whole ticks
  const double spacing_s = axis.of_tick(*parsed.start_tick + parsed.positions->period_ticks);
  const double start_s =
      axis.of_tick(parsed.positions->first_tick) - spacing_s * parsed.positions->first_index;
  // The controller may have taken one more before it saw that it was at the end.
  const double end_s =
      std::max(axis.of_tick(parsed.positions->last_tick),
               parsed.run_ended ? axis.of_tick(parsed.run_ended->tick) : last_known_s(parsed, axis));
  const uint64_t rows = rows_due_by(end_s + rounding * spacing_s, start_s, spacing_s);
  if (!(spacing_s > 0) || rows == 0) return std::nullopt;
  return runfile::StreamGrid{start_s, start_s + spacing_s * static_cast<double>(rows - 1), 1 / spacing_s};
}

}  // namespace diastole
