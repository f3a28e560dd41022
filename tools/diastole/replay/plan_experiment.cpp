#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {
namespace {

using runfile::RecordedRun;
using runfile::RunFile;
using runfile::Segment;
using runfile::Series;

[[noreturn]] void lacks(const RecordedRun& run, const std::string& place, const std::string& what,
                        const std::string& remedy) {
  throw InputError({run.file, place, "cannot be replayed: " + what, remedy});
}

/// The experiment's own text, if it is one that this program's daemon has run.
bool has_experiment(const RecordedRun& run) {
  try {
    TableReader root = TableReader::from_text(run.protocol_toml, "/protocol/toml");
    return root.has("format") && root.text("format") == "diastole-experiment";
  } catch (const InputError&) {
    return false;
  }
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

/// The points files that the experiment names lie in the run file, by segment; here they get names of their own.
void take_points(const RecordedRun& run, ReplayPlan& plan) {
  TableReader root = TableReader::from_text(run.protocol_toml, "/protocol/toml");
  std::vector<TableReader> segments = root.tables("segment");
  std::map<std::string, std::string> renamed;
  for (size_t i = 0; i < segments.size(); ++i) {
    if (!segments[i].has("points")) continue;
    const std::string name = segments[i].text("points");
    if (renamed.contains(name)) continue;
    const auto played = run.waveforms.find(i);
    if (played == run.waveforms.end()) {
      lacks(run, fmt::format("/protocol/waveforms/{}", i),
            fmt::format("the points of {} are not in the file", name), "Replay a run that holds them.");
    }
    renamed[name] = fmt::format("waveform-{}.csv", i);
    plan.points[renamed[name]] = played->second.points;
  }
  for (const auto& [name, own_name] : renamed) {
    for (const char* quote : {"\"", "'"})
      replace_all(plan.experiment_toml, quote + name + quote, fmt::format("\"{}\"", own_name));
  }
}

bool raises_triggers(const RecordedRun& run, const Segment& segment) {
  constexpr double slack_s = 1e-6;
  return std::ranges::any_of(run.trigger_s, [&](double time_s) {
    return time_s >= segment.start_s - slack_s && time_s < segment.end_s() - slack_s;
  });
}

/// Commanded volume at a time, of the next row, or of the last.
double commanded_mL(const runfile::StreamRows& pump, double time_s) {
  if (pump.time_s.size() == 0) return 0;
  size_t row = 0;
  for (size_t behind = pump.time_s.size() - 1; row < behind;) {
    const size_t middle = row + (behind - row) / 2;
    if (pump.time_s.at(middle) < time_s)
      row = middle + 1;
    else
      behind = middle;
  }
  return pump.values.at("commanded_mL").at(row);
}

/// Stillness, or a way from one volume to another that is no cycle: the controller makes such ways by itself before
/// the next segment.
bool is_between_cycles(const RunFile& file, const Segment& segment) {
  constexpr double closes_mL = 0.5;
  if (segment.waveform == "hold") return !raises_triggers(file.run, segment);
  if (segment.waveform != "uploaded") return false;
  const runfile::StreamRows& pump = file.rows.pump;
  return std::abs(commanded_mL(pump, segment.end_s()) - commanded_mL(pump, segment.start_s)) > closes_mL;
}

/// For recordings of other programs: what the table of segments holds.
void write_experiment(const RunFile& file, ReplayPlan& plan) {
  const RecordedRun& run = file.run;
  const Series& time_s = file.rows.pressure.time_s;
  if (run.segments.empty()) {
    lacks(run, "/protocol",
          "it holds neither an experiment file (/protocol/toml) nor a segment (/protocol/segments)",
          "Replay a run that tells what was done.");
  }
  if (time_s.size() < 2) lacks(run, "/pressure/time_s", "it holds no samples", "Replay another run.");
  const double rate_Hz = static_cast<double>(time_s.size() - 1) / (time_s.back() - time_s.front());
  double rest_s = 0;
  std::string segments;
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const Segment& segment = run.segments[i];
    if (is_between_cycles(file, segment)) {
      if (segments.empty()) rest_s += segment.end_s() - segment.start_s;
      plan.remarks.push_back(
          fmt::format("segment {} ({}, {:g} s) raises no trigger or is no cycle: {}", i, segment.waveform,
                      segment.period_s * static_cast<double>(segment.cycles),
                      segments.empty() ? "its time is rest before the first cycle" : "it is left out"));
      continue;
    }
    if (segment.waveform == "uploaded") {
      lacks(run, fmt::format("/protocol/waveforms/{}", i),
            "the uploaded waveform's points are not in the file", "Replay a run that holds them.");
    }
    segments += fmt::format(
        "[[segment]]\nwaveform = \"{}\"\nstroke_mL = {}\nperiod_s = {}\noffset_mL = {}\ncycles = {}\n",
        segment.waveform, segment.stroke_mL, segment.period_s, segment.offset_mL, segment.cycles);
  }
  if (segments.empty()) lacks(run, "/protocol/segments", "none of its segments moves", "Replay another run.");
  plan.experiment_toml = fmt::format(
      "format = \"diastole-experiment\"\nversion = 1\nsample_rate_Hz = {:.9g}\nrest_s = {:.9g}\n{}", rate_Hz,
      rest_s, segments);
  plan.remarks.push_back(
      "/protocol/toml is no experiment file of this program: the experiment was made of /protocol/segments; "
      "the controller's own acceleration, and triggers that rise with a cycle's first step, may differ from "
      "what was recorded");
}

/// Rows of /pressure a second, on the clock of the host that polls the replay's instrument.
std::optional<double> kept_rate_Hz(const RunFile& file) {
  const Series& time_s = file.rows.pressure.time_s;
  if (time_s.size() < 2) return std::nullopt;
  const auto drift = file.run.clock.find("host_drift_ppm");
  const double host_ppm = drift == file.run.clock.end() ? 0 : drift->second;
  return static_cast<double>(time_s.size() - 1) / (time_s.back() - time_s.front()) / (1 + 1e-6 * host_ppm);
}

/// An instrument that takes its samples by its own clock does not keep the rate that it was asked for: the replay's is
/// asked for the one that was kept.
void take_rate(const RunFile& file, ReplayPlan& plan) {
  constexpr double as_it_says = 1e-6;  // of the rate: no drift, only the fit's noise
  TableReader root = TableReader::from_text(file.run.protocol_toml, "/protocol/toml");
  const auto planned_Hz = rig_number(file.run, "daq_rate_Hz");
  const auto kept_Hz = kept_rate_Hz(file);
  if (!planned_Hz || !kept_Hz || *planned_Hz == root.number_or("sample_rate_Hz", 300)) return;
  const double rate_Hz = std::abs(*kept_Hz / *planned_Hz - 1) < as_it_says ? *planned_Hz : *kept_Hz;
  static const std::regex asked("(^|\n)[ \t]*sample_rate_Hz[ \t]*=[^\n]*");
  plan.experiment_toml = fmt::format("sample_rate_Hz = {:.12g}\n{}", rate_Hz,
                                     std::regex_replace(plan.experiment_toml, asked, "$1"));
  plan.remarks.push_back(
      fmt::format("the instrument kept {:.6g} Hz of the {:g} Hz asked for: the replay asks for that", rate_Hz,
                  root.number_or("sample_rate_Hz", 300)));
}

}  // namespace

void plan_experiment(const RunFile& file, ReplayPlan& plan) {
  if (!has_experiment(file.run)) return write_experiment(file, plan);
  plan.experiment_toml = file.run.protocol_toml;
  take_rate(file, plan);
  take_points(file.run, plan);
}

}  // namespace diastole::replay
