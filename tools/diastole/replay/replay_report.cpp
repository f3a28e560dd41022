#include "tools/diastole/replay/replay_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "protocol/contract/named_members.hpp"

namespace diastole::replay {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Comparison, triggers_equal, steps_equal, samples_equal, missing_equal,
                                   pressure_equal, events_equal, max_trigger_diff_s, max_steps_diff,
                                   max_abs_diff_kPa, tolerance_kPa, start_phase_s, max_sample_time_diff_s)
namespace {

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::equal:
      return "equal";
    case Verdict::differs:
      return "DIFFERS";
    case Verdict::reported:
      break;
  }
  return "-";
}

std::string place_of(const Difference& difference) {
  return difference.cycle < 0 ? "before the first cycle" : fmt::format("cycle {}", difference.cycle);
}

}  // namespace

std::string as_table(const ReplayReport& report) {
  std::string text = fmt::format("{} replayed by {}: {:.1f} s in {:.1f} s\n\n", report.recorded,
                                 report.firmware, report.simulated_s, report.wall_s);
  const Line head{"", "recorded", "replayed", "difference", Verdict::reported};
  std::vector<const Line*> lines{&head};
  for (const Line& line : report.comparison.lines)
    lines.push_back(&line);
  const auto width = [&](std::string Line::*column) {
    size_t most = 0;
    for (const Line* line : lines)
      most = std::max(most, (line->*column).size());
    return most;
  };
  const size_t what = width(&Line::what), recorded = width(&Line::recorded),
               replayed = width(&Line::replayed), difference = width(&Line::difference);
  for (const Line* line : lines) {
    text += fmt::format("  {:<{}}  {:<{}}  {:<{}}  {:<{}}  {}\n", line->what, what, line->recorded, recorded,
                        line->replayed, replayed, line->difference, difference,
                        line == &head ? "verdict" : name_of(line->verdict));
  }
  text += '\n';
  for (const std::string& remark : report.plan.remarks)
    text += fmt::format("note: {}\n", remark);
  if (report.comparison.first) {
    const Difference& first = *report.comparison.first;
    text += fmt::format("The runs part at {:.6f} s, {}: {}\n", first.time_s, place_of(first), first.text);
  } else if (!report.comparison.equal()) {
    text += "The runs differ.\n";
  } else if (report.comparison.samples_in_time()) {
    text += "The replay is the recording.\n";
  } else {
    text += fmt::format(
        "The replay is the recording, but for the times of samples: up to {:.3f} ms off, more than their "
        "spacing of {:.3f} ms. Lateness of the recording's host or instrument is not replayed.\n",
        1e3 * report.comparison.max_sample_time_diff_s, 1e3 * report.comparison.sample_spacing_s);
  }
  return text;
}

nlohmann::json as_json(const ReplayReport& report) {
  using nlohmann::json;
  const Comparison& found = report.comparison;
  json lines = json::array();
  for (const Line& line : found.lines) {
    lines.push_back({DIASTOLE_NAMED(line, what, recorded, replayed, difference),
                     {"verdict", line.verdict == Verdict::reported ? "told"
                                 : line.verdict == Verdict::equal  ? "equal"
                                                                   : "differs"}});
  }
  json first;
  if (found.first) first = {DIASTOLE_NAMED(*found.first, time_s, cycle, text)};
  json document = found;
  document.update({{"run", report.recorded},
                   {"replayed", report.replayed.empty() ? json() : json(report.replayed)},
                   {"firmware", report.firmware},
                   {"equal", found.equal()},
                   {"sample_times_equal", found.samples_in_time()},
                   {"host_drift_ppm", report.plan.host_drift_ppm},
                   {"first_difference", first},
                   {"lines", lines},
                   {"remarks", report.plan.remarks},
                   {"simulated_seconds", report.simulated_s},
                   {"wall_seconds", report.wall_s}});
  return document;
}

}  // namespace diastole::replay
