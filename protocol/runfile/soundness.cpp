#include "protocol/runfile/soundness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "protocol/runfile/layout.hpp"

namespace diastole::runfile {
namespace {

constexpr double period_tolerance = 0.01;

StreamFacts facts_of(const RecordedRun& run, std::span<const double> time_s, std::string_view stream) {
  StreamFacts facts{.rows = time_s.size()};
  for (const Gap& gap : run.gaps) {
    if (gap.stream.starts_with(stream)) facts.missing += gap.count;
  }
  const double spacing_s = median_spacing_s(time_s);
  if (spacing_s > 0) facts.rate_Hz = 1 / spacing_s;
  facts.irregularity = irregularity_of(time_s, spacing_s);
  return facts;
}

void look_for_holes(std::span<const double> time_s, std::string_view stream,
                    std::vector<std::string>& problems) {
  const std::vector<size_t> holes = holes_before(time_s, median_spacing_s(time_s));
  if (holes.empty()) return;
  const size_t first = holes.front();
  problems.push_back(fmt::format(
      "{}: {:.1f} ms without a sample before index {}, not declared as a gap{}", stream,
      1e3 * (time_s[first] - time_s[first - 1]), first,
      holes.size() > 1 ? fmt::format(", and {} more such holes", holes.size() - 1) : std::string()));
}

/// Triggers of one segment: as many as cycles (or fewer, if the run was stopped on request), one period apart.
void check_triggers(const RecordedRun& run, size_t number, bool stopped, std::vector<std::string>& problems) {
  const Segment& segment = run.segments[number];
  const double slack_s = 0.5 * period_tolerance * segment.period_s;
  std::vector<double> found;
  for (const double t : run.trigger_s) {
    if (t >= segment.start_s - slack_s && t < segment.end_s() - slack_s) found.push_back(t);
  }
  const bool holds = segment.waveform == "hold";
  const auto triggers = static_cast<int64_t>(found.size());
  const bool fits = triggers == segment.cycles || (stopped && triggers < segment.cycles);
  if (!fits && !(holds && found.empty())) {
    problems.push_back(
        fmt::format("segment {}: {} triggers for {} cycles", number, triggers, segment.cycles));
  }
  for (size_t i = 1; i < found.size(); ++i) {
    if (std::abs(found[i] - found[i - 1] - segment.period_s) <= period_tolerance * segment.period_s) continue;
    problems.push_back(fmt::format("segment {}: trigger {} comes {:.4f} s after the one before, not {:.4f} s",
                                   number, i, found[i] - found[i - 1], segment.period_s));
    return;
  }
}

}  // namespace

bool is_stop_on_request(std::string_view code) {
  return code == "stopped_at_cycle_end" || code == "stopped_now";
}

Soundness assess(const RecordedRun& run) {
  Soundness soundness;
  auto& problems = soundness.problems;
  soundness.pressure = facts_of(run, run.pressure.time_s, pressure_stream);
  soundness.pump = facts_of(run, run.pump.time_s, pump_stream);
  if (!soundness.pressure.any()) problems.emplace_back("no pressure was recorded");
  if (!run.pressure.time_s.empty()) {
    soundness.duration_s = run.pressure.time_s.back() - run.pressure.time_s.front();
  }
  for (const Gap& gap : run.gaps) {
    problems.push_back(fmt::format("{}: {} missing from index {} on: {}", gap.stream, gap.count,
                                   gap.first_index, gap.reason));
  }
  soundness.stopped_on_request = std::any_of(run.events.begin(), run.events.end(),
                                             [](const Event& e) { return is_stop_on_request(e.code); });
  look_for_holes(run.pressure.time_s, pressure_stream, problems);
  look_for_holes(run.pump.time_s, pump_stream, problems);
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const Segment& segment = run.segments[i];
    (segment.waveform == "hold" ? soundness.scheduled_holds : soundness.scheduled_cycles) += segment.cycles;
    check_triggers(run, i, soundness.stopped_on_request, problems);
  }
  for (const Event& event : run.events) {
    if (event.level == "error") {
      problems.push_back(fmt::format("at {:.3f} s: {}: {}", event.time_s, event.code, event.text));
    }
  }
  return soundness;
}

}  // namespace diastole::runfile
