#include "tools/diastole/replay/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/runfile/soundness.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {
namespace {

using runfile::Event;
using runfile::RecordedRun;

constexpr double tick_s = 1.0 / 84e6;
constexpr double trigger_tolerance_s = tick_s + 1e-9;  // a run file's times are rounded
constexpr size_t most_positions_on_the_line = 30;      // of one message
constexpr double fault_tolerance_s = 250e-6 + tick_s;
constexpr double lease_tolerance_s = 50e-3 + tick_s;  // a heartbeat, whose phase is not in the file

/// Pump and trigger rows of each cycle: [from trigger k, to trigger k + 1), the last to the end.
struct CycleSteps {
  int64_t inflating = 0;
  int64_t deflating = 0;
};

/// Rows whose position stands in both; a missing one is no standstill.
std::vector<size_t> known_positions(const RecordedRun& one, const RecordedRun& other) {
  std::vector<size_t> rows;
  for (size_t i = 0; i < std::min(one.pump.time_s.size(), other.pump.time_s.size()); ++i)
    if (!std::isnan(one.pump.commanded_mL[i]) && !std::isnan(other.pump.commanded_mL[i])) rows.push_back(i);
  return rows;
}

/// Steps of each cycle of the recording, as the positions in these rows show them.
std::vector<CycleSteps> cycle_steps(const RecordedRun& run, const std::vector<double>& trigger_s,
                                    double microstep_mL, const std::vector<size_t>& rows) {
  std::vector<CycleSteps> cycles(trigger_s.size());
  size_t cycle = 0;
  std::optional<int64_t> last;
  for (const size_t i : rows) {
    const int64_t now = std::llround(run.pump.commanded_mL[i] / microstep_mL);
    while (cycle + 1 < trigger_s.size() && run.pump.time_s[i] >= trigger_s[cycle + 1])
      ++cycle;
    if (last && run.pump.time_s[i] >= trigger_s[0])
      (now > *last ? cycles[cycle].inflating : cycles[cycle].deflating) += std::abs(now - *last);
    last = now;
  }
  return cycles;
}

std::vector<bool> missing_rows(const RecordedRun& run) {
  std::vector<bool> missing(run.pressure.time_s.size(), false);
  for (const auto& [name, values] : run.pressure.channels) {
    if (name.ends_with("_filtered_kPa")) continue;
    for (size_t i = 0; i < values.size(); ++i)
      missing[i] = missing[i] || std::isnan(values[i]);
  }
  return missing;
}

class Comparer {
 public:
  Comparer(const RecordedRun& recorded, const RecordedRun& replayed)
      : recorded_(recorded),
        replayed_(replayed),
        broke_off_(end_of(recorded) == "incomplete"),
        link_lost_(end_of(recorded) == "link_lost") {}

  Comparison run() {
    compare_triggers();
    compare_positions();
    compare_cycles();
    compare_samples();
    for (const auto& [name, values] : recorded_.pressure.channels)
      compare_channel(name, values);
    compare_events();
    compare_end();
    return std::move(out_);
  }

 private:
  void differs_at(double time_s, std::string text) {
    if (out_.first && out_.first->time_s <= time_s) return;
    const auto after = std::ranges::upper_bound(recorded_.trigger_s, time_s);
    out_.first = Difference{time_s, after - recorded_.trigger_s.begin() - 1, std::move(text)};
  }
  void add(std::string what, std::string recorded, std::string replayed, std::string difference, bool equal) {
    out_.lines.push_back({std::move(what), std::move(recorded), std::move(replayed), std::move(difference),
                          equal ? Verdict::equal : Verdict::differs});
  }
  /// Of a broken-off recording the replay may have more; else they differ by `slack` at most.
  void compare_counts(const char* what, size_t recorded, size_t replayed, size_t slack, bool& equal) {
    equal = (broke_off_ && replayed > recorded) ||
            std::max(recorded, replayed) - std::min(recorded, replayed) <= slack;
    add(what, fmt::format("{}", recorded), fmt::format("{}", replayed),
        fmt::format("{:+d}", static_cast<int64_t>(replayed) - static_cast<int64_t>(recorded)), equal);
  }

  void compare_triggers() {
    const auto &before = recorded_.trigger_s, &after = replayed_.trigger_s;
    compare_counts("triggers", before.size(), after.size(), 0, out_.triggers_equal);
    const size_t common = std::min(before.size(), after.size());
    bool in_time = true;
    for (size_t i = 0; i < common; ++i) {
      const double diff_s = after[i] - before[i];
      if (std::abs(diff_s) > std::abs(out_.max_trigger_diff_s)) out_.max_trigger_diff_s = diff_s;
      if (std::abs(diff_s) <= trigger_tolerance_s) continue;
      in_time = false;
      differs_at(before[i], fmt::format("trigger {} came at {:.9f} s, and comes {:+.3f} us off", i, before[i],
                                        1e6 * diff_s));
    }
    if (!out_.triggers_equal && before.size() > common) {
      differs_at(before[common], fmt::format("trigger {} is missing in the replay", common));
    } else if (!out_.triggers_equal) {
      differs_at(after[common], fmt::format("trigger {} is not in the recording", common));
    }
    if (common > 0) {
      add("trigger times, first and last", fmt::format("{:.6f} s, {:.6f} s", before[0], before[common - 1]),
          fmt::format("{:.6f} s, {:.6f} s", after[0], after[common - 1]),
          fmt::format("{:.3f} us at most", 1e6 * std::abs(out_.max_trigger_diff_s)), in_time);
    }
    out_.triggers_equal = out_.triggers_equal && in_time;
  }
  void compare_positions() {
    const double microstep_mL = rig_number(recorded_, "volume_per_step_mL").value_or(1);
    const auto &before = recorded_.pump, &after = replayed_.pump;
    compare_counts("positions of the piston", before.time_s.size(), after.time_s.size(),
                   link_lost_ ? most_positions_on_the_line : 0, out_.steps_equal);
    bool equal = true;
    int64_t most = 0;
    const size_t common = std::min(before.time_s.size(), after.time_s.size());
    for (size_t i = 0; i < common; ++i) {
      if (std::isnan(before.commanded_mL[i]) || std::isnan(after.commanded_mL[i])) continue;
      const int64_t was = std::llround(before.commanded_mL[i] / microstep_mL);
      const int64_t is = std::llround(after.commanded_mL[i] / microstep_mL);
      most = std::max(most, std::abs(is - was));
      const double diff_s = after.time_s[i] - before.time_s[i];
      if (is == was && std::abs(diff_s) <= trigger_tolerance_s) continue;
      equal = false;
      if (is != was) {
        differs_at(before.time_s[i],
                   fmt::format("the piston stood at {} microsteps, and stands at {}", was, is));
      } else {
        differs_at(before.time_s[i], fmt::format("its position was taken {:+.3f} us off", 1e6 * diff_s));
      }
    }
    out_.max_steps_diff = most;
    const std::vector<size_t> known = known_positions(recorded_, replayed_);
    const auto last = [&](const runfile::PumpTrace& pump) {
      return known.empty() ? std::string("-")
                           : fmt::format("{}", std::llround(pump.commanded_mL[known.back()] / microstep_mL));
    };
    add("positions, last one in microsteps", last(before), last(after), fmt::format("{} at most", most),
        equal);
    if (!out_.steps_equal && common > 0)
      differs_at(before.time_s[common - 1], "positions end here in one of the two");
    out_.steps_equal = out_.steps_equal && equal;
  }
  void compare_cycles() {
    const double microstep_mL = rig_number(recorded_, "volume_per_step_mL").value_or(1);
    const std::vector<size_t> rows = known_positions(recorded_, replayed_);
    if (rows.empty() || recorded_.trigger_s.empty()) return;
    const auto before = cycle_steps(recorded_, recorded_.trigger_s, microstep_mL, rows);
    const auto after = cycle_steps(replayed_, recorded_.trigger_s, microstep_mL, rows);
    const auto compare_way = [&](const char* what, int64_t CycleSteps::*way) {
      int64_t was = 0, is = 0, worst = 0;
      size_t where = 0;
      for (size_t i = 0; i < before.size(); ++i) {
        was += before[i].*way;
        is += after[i].*way;
        const int64_t diff = std::abs(after[i].*way - before[i].*way);
        if (diff > worst) where = i;
        worst = std::max(worst, diff);
      }
      add(what, fmt::format("{}", was), fmt::format("{}", is),
          worst == 0 ? "0 in every cycle" : fmt::format("{} in cycle {}", worst, where), worst == 0);
      out_.steps_equal = out_.steps_equal && worst == 0;
    };
    compare_way("microsteps inflating, all cycles", &CycleSteps::inflating);
    compare_way("microsteps deflating, all cycles", &CycleSteps::deflating);
  }
  void compare_samples() {
    const auto &before = recorded_.pressure.time_s, &after = replayed_.pressure.time_s;
    const size_t common = std::min(before.size(), after.size());
    if (common > 0) out_.start_phase_s = after[0] - before[0];
    const size_t at_the_end = std::abs(out_.start_phase_s) > tick_s ? 1 : 0;
    compare_counts("samples", before.size(), after.size(), at_the_end, out_.samples_equal);
    if (!out_.samples_equal && common > 0) {
      differs_at(before[common - 1], before.size() > common ? "samples end here in the replay"
                                                            : "samples end here in the recording");
    }
    compare_missing(common);
    if (common < 2) return;
    double most_s = 0;
    for (size_t i = 0; i < common; ++i)
      most_s = std::max(most_s, std::abs(after[i] - before[i] - out_.start_phase_s));
    out_.max_sample_time_diff_s = most_s;
    out_.sample_spacing_s = (before.back() - before.front()) / static_cast<double>(before.size() - 1);
    out_.lines.push_back({"first sample after the start of run", fmt::format("{:.6f} s", before[0]),
                          fmt::format("{:.6f} s", after[0]),
                          fmt::format("start phase {:+.3f} ms; then {:.3f} us at most",
                                      1e3 * out_.start_phase_s, 1e6 * most_s),
                          Verdict::reported});
  }
  void compare_missing(size_t rows) {
    const auto before = missing_rows(recorded_), after = missing_rows(replayed_);
    for (size_t i = 0; i < rows; ++i) {
      if (before[i] == after[i]) continue;
      out_.missing_equal = false;
      differs_at(recorded_.pressure.time_s[i],
                 fmt::format("sample {} {}", i,
                             before[i] ? "was missing, and is there" : "was there, and is missing"));
    }
    const auto count = [&](const std::vector<bool>& missing) {
      return std::count(missing.begin(), missing.begin() + static_cast<std::ptrdiff_t>(rows), true);
    };
    add("samples missing", fmt::format("{}", count(before)), fmt::format("{}", count(after)),
        out_.missing_equal ? "the same ones" : "others", out_.missing_equal);
  }
  void compare_channel(const std::string& name, const std::vector<double>& values) {
    const auto found = replayed_.pressure.channels.find(name);
    if (name.ends_with("_filtered_kPa") || !name.ends_with("_kPa")) return;
    if (found == replayed_.pressure.channels.end()) {
      out_.pressure_equal = false;
      return add(name, "recorded", "-", "not replayed", false);
    }
    const size_t rows = std::min(values.size(), found->second.size());
    double largest_kPa = 0, least_kPa = HUGE_VAL, most_kPa = -HUGE_VAL, worst_kPa = 0;
    for (size_t i = 0; i < rows; ++i) {
      if (std::isnan(values[i])) continue;
      largest_kPa = std::max(largest_kPa, std::abs(values[i]));
      least_kPa = std::min(least_kPa, values[i]);
      most_kPa = std::max(most_kPa, values[i]);
    }
    const double tolerance_kPa = resolution_kPa(name, largest_kPa);
    bool equal = true;
    double least_now_kPa = HUGE_VAL, most_now_kPa = -HUGE_VAL;
    for (size_t i = 0; i < rows; ++i) {
      const double now_kPa = found->second[i];
      if (std::isnan(now_kPa)) continue;
      least_now_kPa = std::min(least_now_kPa, now_kPa);
      most_now_kPa = std::max(most_now_kPa, now_kPa);
      if (std::isnan(values[i])) continue;
      const double diff_kPa = std::abs(now_kPa - values[i]);
      worst_kPa = std::max(worst_kPa, diff_kPa);
      if (diff_kPa <= tolerance_kPa) continue;
      equal = false;
      differs_at(recorded_.pressure.time_s[i],
                 fmt::format("{} of sample {} was {:.6f}, and is {:.6f}", name, i, values[i], now_kPa));
    }
    const auto range = [](double least, double most) {
      return least > most ? std::string("-") : fmt::format("{:.4f} ... {:.4f}", least, most);
    };
    add(name, range(least_kPa, most_kPa), range(least_now_kPa, most_now_kPa),
        fmt::format("{:.2g} at most, {:.2g} allowed", worst_kPa, tolerance_kPa), equal);
    out_.pressure_equal = out_.pressure_equal && equal;
    out_.max_abs_diff_kPa = std::max(out_.max_abs_diff_kPa, worst_kPa);
    out_.tolerance_kPa = std::max(out_.tolerance_kPa, tolerance_kPa);
  }
  void compare_events() {
    const std::vector<Event> before = comparable(recorded_), after = comparable(replayed_);
    const double sample_s = recorded_.pressure.time_s.size() < 2
                                ? 0
                                : (recorded_.pressure.time_s.back() - recorded_.pressure.time_s.front()) /
                                      static_cast<double>(recorded_.pressure.time_s.size() - 1);
    const auto described = [](const Event* event) {
      return event == nullptr ? std::string("-") : fmt::format("{} at {:.6f} s", event->code, event->time_s);
    };
    for (size_t i = 0; i < std::max(before.size(), after.size()); ++i) {
      const Event* was = i < before.size() ? &before[i] : nullptr;
      const Event* is = i < after.size() ? &after[i] : nullptr;
      if (was == nullptr && broke_off_) break;
      const double host_tolerance_s =
          sample_s + std::abs(out_.start_phase_s);  // its turns lie on the samples' grid
      const double tolerance_s = was == nullptr                   ? 0
                                 : was->code == "lease_lost"      ? lease_tolerance_s
                                 : is_controller_fault(was->code) ? fault_tolerance_s
                                                                  : host_tolerance_s;
      const double diff_s = was != nullptr && is != nullptr ? is->time_s - was->time_s : 0;
      const bool equal =
          was != nullptr && is != nullptr && was->code == is->code && std::abs(diff_s) <= tolerance_s;
      add("event", described(was), described(is), equal ? fmt::format("{:+.3f} us", 1e6 * diff_s) : "",
          equal);
      if (equal) continue;
      out_.events_equal = false;
      differs_at(was != nullptr ? was->time_s : is->time_s,
                 fmt::format("event {}, and now {}", described(was), described(is)));
    }
  }
  void compare_end() {
    const std::string before = end_of(recorded_), after = end_of(replayed_);
    if (broke_off_) {
      out_.lines.push_back({"end", "broken off", after, "", Verdict::reported});
      return;
    }
    add("end", before, after, "", before == after);
    if (before == after) return;
    out_.events_equal = false;
    const double end_s = recorded_.pressure.time_s.empty() ? 0 : recorded_.pressure.time_s.back();
    differs_at(end_s, fmt::format("the run ended \"{}\", and ends \"{}\"", before, after));
  }
  [[nodiscard]] double resolution_kPa(const std::string& name, double largest_kPa) const {
    constexpr double float_step = 0x1p-23;
    const std::string channel = name.substr(0, name.size() - 4);
    const double kPa_per_V = rig_number(replayed_, channel + "_kPa_per_V").value_or(1);
    const double zero_V = rig_number(replayed_, channel + "_zero_V").value_or(0);
    return std::abs(kPa_per_V) * float_step * (std::abs(largest_kPa / kPa_per_V) + std::abs(zero_V));
  }
  /// Faults, stops, losses of the line: what the plan can bring about.
  [[nodiscard]] std::vector<Event> comparable(const RecordedRun& run) const {
    std::vector<Event> events;
    for (const Event& event : run.events) {
      if (is_controller_fault(event.code) || event.code == "stop" || event.code == "link_lost" ||
          runfile::is_stop_on_request(event.code)) {
        events.push_back(event);
      }
    }
    return events;
  }

  const RecordedRun& recorded_;
  const RecordedRun& replayed_;
  bool broke_off_;
  bool link_lost_;
  Comparison out_;
};

}  // namespace

Comparison compare(const RecordedRun& recorded, const RecordedRun& replayed) {
  return Comparer(recorded, replayed).run();
}

}  // namespace diastole::replay
