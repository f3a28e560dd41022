#include "tools/diastole/replay/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/runfile/soundness.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {
namespace {

using runfile::each_block_of;
using runfile::Event;
using runfile::RecordedRun;
using runfile::RunFile;
using runfile::Series;
using runfile::StreamRows;

constexpr double tick_s = 1.0 / 84e6;
constexpr double trigger_tolerance_s = tick_s + 1e-9;  // a run file's times are rounded
constexpr size_t most_positions_on_the_line = 30;      // of one message
constexpr double fault_tolerance_s = 250e-6 + tick_s;
constexpr double lease_tolerance_s = 50e-3 + tick_s;  // a heartbeat, whose phase is not in the file

/// Steps that successive positions show, by the cycle of the recording in which they are made.
class StepsByCycle {
 public:
  struct Cycle {
    int64_t inflating = 0;
    int64_t deflating = 0;
  };

  /// `trigger_s` outlives it: a cycle goes from a trigger to the next, the last to the end.
  explicit StepsByCycle(const std::vector<double>& trigger_s)
      : trigger_s_(trigger_s), cycles_(trigger_s.size()) {}
  void stands_at(double time_s, int64_t microsteps) {
    while (cycle_ + 1 < trigger_s_.size() && time_s >= trigger_s_[cycle_ + 1])
      ++cycle_;
    if (last_ && !trigger_s_.empty() && time_s >= trigger_s_[0]) {
      Cycle& cycle = cycles_[cycle_];
      (microsteps > *last_ ? cycle.inflating : cycle.deflating) += std::abs(microsteps - *last_);
    }
    last_ = microsteps;
  }
  [[nodiscard]] const std::vector<Cycle>& cycles() const { return cycles_; }
  [[nodiscard]] std::optional<int64_t> last_microsteps() const { return last_; }

 private:
  const std::vector<double>& trigger_s_;
  std::vector<Cycle> cycles_;
  size_t cycle_ = 0;
  std::optional<int64_t> last_;
};

/// Of a channel's samples.
struct Range {
  double least = HUGE_VAL;
  double most = -HUGE_VAL;

  void take(double value) {
    if (std::isnan(value)) return;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  [[nodiscard]] double largest() const {
    return least > most ? 0 : std::max(std::abs(least), std::abs(most));
  }
  [[nodiscard]] std::string words() const {
    return least > most ? "-" : fmt::format("{:.4f} ... {:.4f}", least, most);
  }
};

/// Which of the rows from `first` on some channel misses.
void find_missing(const StreamRows& pressure, size_t first, std::vector<char>& missing) {
  std::ranges::fill(missing, 0);
  std::vector<double> memory;
  for (const auto& [name, values] : pressure.values) {
    if (name.ends_with("_filtered_kPa") || values.size() <= first) continue;
    const size_t count = std::min(missing.size(), values.size() - first);
    const std::span<const double> block = values.rows(first, count, memory);
    for (size_t i = 0; i < count; ++i)
      if (std::isnan(block[i])) missing[i] = 1;
  }
}

class Comparer {
 public:
  Comparer(const RunFile& recorded, const RunFile& replayed)
      : recorded_(recorded.run),
        replayed_(replayed.run),
        before_(recorded.rows),
        after_(replayed.rows),
        broke_off_(end_of(recorded.run) == "incomplete"),
        link_lost_(end_of(recorded.run) == "link_lost") {}

  Comparison run() {
    compare_triggers();
    compare_positions();
    compare_samples();
    for (const auto& [name, values] : before_.pressure.values)
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
    const Series &before_s = before_.pump.time_s, &after_s = after_.pump.time_s;
    compare_counts("positions of the piston", before_s.size(), after_s.size(),
                   link_lost_ ? most_positions_on_the_line : 0, out_.steps_equal);
    bool equal = true;
    StepsByCycle before(recorded_.trigger_s), after(recorded_.trigger_s);
    const size_t common = std::min(before_s.size(), after_s.size());
    const auto compare_block = [&](size_t, std::span<const std::span<const double>> columns) {
      for (size_t i = 0; i < columns[0].size(); ++i) {
        const double was_s = columns[0][i], was_mL = columns[1][i], is_s = columns[2][i],
                     is_mL = columns[3][i];
        if (std::isnan(was_mL) || std::isnan(is_mL)) continue;  // a missing position is no standstill
        const int64_t was = std::llround(was_mL / microstep_mL), is = std::llround(is_mL / microstep_mL);
        before.stands_at(was_s, was);
        after.stands_at(is_s, is);
        out_.max_steps_diff = std::max(out_.max_steps_diff, std::abs(is - was));
        const double diff_s = is_s - was_s;
        if (is == was && std::abs(diff_s) <= trigger_tolerance_s) continue;
        equal = false;
        if (is != was) {
          differs_at(was_s, fmt::format("the piston stood at {} microsteps, and stands at {}", was, is));
        } else {
          differs_at(was_s, fmt::format("its position was taken {:+.3f} us off", 1e6 * diff_s));
        }
      }
    };
    each_block_of({&before_s, &before_.pump.values.at("commanded_mL"), &after_s,
                   &after_.pump.values.at("commanded_mL")},
                  common, compare_block);
    const auto last = [](const StepsByCycle& steps) {
      return steps.last_microsteps() ? fmt::format("{}", *steps.last_microsteps()) : "-";
    };
    add("positions, last one in microsteps", last(before), last(after),
        fmt::format("{} at most", out_.max_steps_diff), equal);
    if (!out_.steps_equal && common > 0)
      differs_at(before_s.at(common - 1), "positions end here in one of the two");
    out_.steps_equal = out_.steps_equal && equal;
    if (before.last_microsteps() && !recorded_.trigger_s.empty())
      compare_cycles(before.cycles(), after.cycles());
  }
  void compare_cycles(const std::vector<StepsByCycle::Cycle>& before,
                      const std::vector<StepsByCycle::Cycle>& after) {
    const auto compare_way = [&](const char* what, int64_t StepsByCycle::Cycle::*way) {
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
    compare_way("microsteps inflating, all cycles", &StepsByCycle::Cycle::inflating);
    compare_way("microsteps deflating, all cycles", &StepsByCycle::Cycle::deflating);
  }
  void compare_samples() {
    const Series &before_s = before_.pressure.time_s, &after_s = after_.pressure.time_s;
    const size_t common = std::min(before_s.size(), after_s.size());
    if (common > 0) out_.start_phase_s = after_s.front() - before_s.front();
    const size_t at_the_end = std::abs(out_.start_phase_s) > tick_s ? 1 : 0;
    compare_counts("samples", before_s.size(), after_s.size(), at_the_end, out_.samples_equal);
    if (!out_.samples_equal && common > 0) {
      differs_at(before_s.at(common - 1), before_s.size() > common ? "samples end here in the replay"
                                                                   : "samples end here in the recording");
    }
    compare_missing(common);
    if (common < 2) return;
    double most_s = 0;
    each_block_of({&before_s, &after_s}, common,
                  [&](size_t, std::span<const std::span<const double>> time_s) {
                    for (size_t i = 0; i < time_s[0].size(); ++i)
                      most_s = std::max(most_s, std::abs(time_s[1][i] - time_s[0][i] - out_.start_phase_s));
                  });
    out_.max_sample_time_diff_s = most_s;
    out_.sample_spacing_s = spacing_s(before_s);
    out_.lines.push_back({"first sample after the start of run", fmt::format("{:.6f} s", before_s.front()),
                          fmt::format("{:.6f} s", after_s.front()),
                          fmt::format("start phase {:+.3f} ms; then {:.3f} us at most",
                                      1e3 * out_.start_phase_s, 1e6 * most_s),
                          Verdict::reported});
  }
  /// 0 for fewer than two samples.
  static double spacing_s(const Series& time_s) {
    if (time_s.size() < 2) return 0;
    return (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
  }
  void compare_missing(size_t rows) {
    int64_t count_before = 0, count_after = 0;
    std::vector<char> before, after;
    each_block_of({&before_.pressure.time_s}, rows,
                  [&](size_t first, std::span<const std::span<const double>> time_s) {
                    before.resize(time_s[0].size());
                    after.resize(time_s[0].size());
                    find_missing(before_.pressure, first, before);
                    find_missing(after_.pressure, first, after);
                    count_before += std::ranges::count(before, 1);
                    count_after += std::ranges::count(after, 1);
                    for (size_t i = 0; i < before.size(); ++i) {
                      if (before[i] == after[i]) continue;
                      out_.missing_equal = false;
                      differs_at(time_s[0][i], fmt::format("sample {} {}", first + i,
                                                           before[i] != 0 ? "was missing, and is there"
                                                                          : "was there, and is missing"));
                    }
                  });
    add("samples missing", fmt::format("{}", count_before), fmt::format("{}", count_after),
        out_.missing_equal ? "the same ones" : "others", out_.missing_equal);
  }
  void compare_channel(const std::string& name, const Series& values_kPa) {
    const auto found = after_.pressure.values.find(name);
    if (name.ends_with("_filtered_kPa") || !name.ends_with("_kPa")) return;
    if (found == after_.pressure.values.end()) {
      out_.pressure_equal = false;
      return add(name, "recorded", "-", "not replayed", false);
    }
    const size_t rows = std::min(values_kPa.size(), found->second.size());
    Range was, is;
    each_block_of({&values_kPa, &found->second}, rows,
                  [&](size_t, std::span<const std::span<const double>> kPa) {
                    for (size_t i = 0; i < kPa[0].size(); ++i) {
                      was.take(kPa[0][i]);
                      is.take(kPa[1][i]);
                    }
                  });
    const double tolerance_kPa = resolution_kPa(name, was.largest());
    double worst_kPa = 0;
    bool equal = true;
    const auto compare_block = [&](size_t first, std::span<const std::span<const double>> columns) {
      for (size_t i = 0; i < columns[0].size(); ++i) {
        const double was_kPa = columns[1][i], is_kPa = columns[2][i];
        if (std::isnan(was_kPa) || std::isnan(is_kPa)) continue;
        const double diff_kPa = std::abs(is_kPa - was_kPa);
        worst_kPa = std::max(worst_kPa, diff_kPa);
        if (diff_kPa <= tolerance_kPa) continue;
        equal = false;
        differs_at(columns[0][i], fmt::format("{} of sample {} was {:.6f}, and is {:.6f}", name, first + i,
                                              was_kPa, is_kPa));
      }
    };
    each_block_of({&before_.pressure.time_s, &values_kPa, &found->second}, rows, compare_block);
    add(name, was.words(), is.words(),
        fmt::format("{:.2g} at most, {:.2g} allowed", worst_kPa, tolerance_kPa), equal);
    out_.pressure_equal = out_.pressure_equal && equal;
    out_.max_abs_diff_kPa = std::max(out_.max_abs_diff_kPa, worst_kPa);
    out_.tolerance_kPa = std::max(out_.tolerance_kPa, tolerance_kPa);
  }
  void compare_events() {
    const std::vector<Event> before = comparable(recorded_), after = comparable(replayed_);
    const double sample_s = spacing_s(before_.pressure.time_s);
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
    const Series& samples_s = before_.pressure.time_s;
    const double end_s = samples_s.size() == 0 ? 0 : samples_s.back();
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
  const runfile::RunRows& before_;
  const runfile::RunRows& after_;
  bool broke_off_;
  bool link_lost_;
  Comparison out_;
};

}  // namespace

Comparison compare(const RunFile& recorded, const RunFile& replayed) {
  return Comparer(recorded, replayed).run();
}

}  // namespace diastole::replay
