#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/config/schedule.hpp"
#include "host/journal/part_file.hpp"
#include "host/runfile/output_guard.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/signal_delay.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr double s_per_ms = 1e-3;
constexpr size_t default_frames = 16;

/// What was removed from the signal's times, and where that figure comes from ("given", "the run: catheter ...").
struct RemovedDelay {
  double delay_s = 0;
  std::string source;
};

struct BinOptions {
  std::string run;
  std::optional<size_t> frames;
  std::vector<std::string> windows;
  std::string frame_times;
  std::optional<double> first_ms, tr_ms, width_ms;
  std::optional<int64_t> gate_every;
  std::string delay_ms;
  std::optional<size_t> segment, slice;
  std::string channel = "cavity_kPa";
  std::string frames_csv;
  bool relative = false;
  bool force = false;

  [[nodiscard]] bool frames_given() const { return frames || real_windows(); }
  [[nodiscard]] bool real_windows() const { return !frame_times.empty() || tr_ms || !windows.empty(); }
};

runfile::FrameWindow parse_window(const std::string& text) {
  runfile::FrameWindow window;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf:%lf%c", &window.from_s, &window.to_s, &rest) != 2) {
    throw InputError(
        {"", "--window " + text, "is not FROM:TO", "For example --window 0.10:0.15, in seconds."});
  }
  return window;
}

/// Empty: equal frames.
std::vector<runfile::FrameWindow> windows_asked(const BinOptions& options, double interval_s) {
  std::vector<runfile::FrameWindow> windows;
  for (const std::string& window : options.windows)
    windows.push_back(parse_window(window));
  std::vector<runfile::FrameStart> starts;
  if (!options.frame_times.empty()) starts = runfile::read_frame_times(options.frame_times);
  if (options.tr_ms) {
    starts = runfile::repeated_starts(options.frames.value_or(default_frames),
                                      s_per_ms * options.first_ms.value_or(0), s_per_ms * *options.tr_ms);
  }
  if (starts.empty()) return windows;
  std::optional<double> width_s;
  if (options.width_ms) width_s = s_per_ms * *options.width_ms;
  return runfile::windows_of(starts, width_s, interval_s);
}

/// What the run's schedule says of the frames, if all slices that are binned belong to one block.
std::optional<ScheduleBlock> scheduled_block(const BinOptions& options, const runfile::RecordedRun& run) {
  std::set<std::string> names;
  for (size_t i = 0; i < run.slices.size(); ++i)
    if (!options.slice || *options.slice == i) names.insert(run.slices[i].block);
  if (names.size() != 1) return std::nullopt;
  const auto schedule = schedule_of(run.protocol_toml, run.file);
  if (!schedule) return std::nullopt;
  const auto block = std::ranges::find(schedule->blocks, *names.begin(), &ScheduleBlock::name);
  if (block == schedule->blocks.end() || !block->frames) return std::nullopt;
  return *block;
}

/// Where no frames are asked for, those of the schedule are.
void take_from_schedule(BinOptions& options, const runfile::RecordedRun& run) {
  if (options.frames_given()) return;
  const auto block = scheduled_block(options, run);
  if (!block) return;
  options.frames = static_cast<size_t>(block->frames->frames);
  options.first_ms = block->frames->first_ms;
  options.tr_ms = block->frames->tr_ms;
  if (!options.gate_every) options.gate_every = block->gate_every;
  fmt::print(stderr, "frames as scheduled for {}: {} from {:g} ms on, {:g} ms apart\n", block->name,
             *options.frames, *options.first_ms, *options.tr_ms);
}

RemovedDelay delay_asked(const BinOptions& options, const runfile::RecordedRun& run) {
  const bool from_run = options.delay_ms == "run" || (options.delay_ms.empty() && options.real_windows());
  if (from_run) {
    const runfile::SignalDelay delay = runfile::signal_delay(run, options.channel);
    return {delay.total_s(), fmt::format("the run: catheter {:.2f} ms, filter {:.2f} ms",
                                         1e3 * delay.catheter_s, 1e3 * delay.filter_s)};
  }
  if (options.delay_ms.empty()) return {0, "none asked for"};
  char* end = nullptr;
  const double delay_ms = std::strtod(options.delay_ms.c_str(), &end);
  if (*end != '\0' || !(std::abs(delay_ms) <= 1000)) {
    throw InputError({"", "--delay-ms " + options.delay_ms, "is neither a number of milliseconds nor \"run\"",
                      "For example --delay-ms 3.2, or --delay-ms run for what the run file tells."});
  }
  return {s_per_ms * delay_ms, "given"};
}

json bins_as_json(const std::string& run, const runfile::FrameBins& bins, const RemovedDelay& delay) {
  json frames = json::array();
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    frames.push_back({{"frame", k},
                      DIASTOLE_NAMED(bin.window, from_s, to_s),
                      DIASTOLE_NAMED(bin, mean_kPa, sd_kPa, sample_sd_kPa, drift_kPa_per_cycle,
                                     drift_se_kPa_per_cycle, cycles, samples)});
  }
  json excluded = json::array();
  for (const runfile::ExcludedCycle& cycle : bins.excluded)
    excluded.push_back({DIASTOLE_NAMED(cycle, cycle, trigger_s, reason)});
  return {{"run", run},
          DIASTOLE_NAMED(bins, segment, period_s, interval_s, scheduled_cycles, triggers),
          {"delay_removed_s", delay.delay_s},
          {"delay_source", delay.source},
          {"frames", frames},
          {"excluded", excluded}};
}

void show_bins(const runfile::FrameBins& bins, const RemovedDelay& delay) {
  fmt::print("segment {}, period {:g} s, {} of {} cycles used\n", bins.segment, bins.period_s,
             bins.frames.front().cycles, bins.scheduled_cycles);
  if (delay.delay_s != 0) fmt::print("{:.2f} ms of delay removed ({})\n", 1e3 * delay.delay_s, delay.source);
  fmt::print("frame    from_s      to_s  mean_kPa    sd_kPa  drift_Pa_per_cycle  cycles\n");
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    fmt::print("{:5} {:9.4f} {:9.4f} {:9.4f} {:9.4f} {:19.3f} {:7}\n", k, bin.window.from_s, bin.window.to_s,
               bin.mean_kPa, bin.sd_kPa, 1e3 * bin.drift_kPa_per_cycle, bin.cycles);
  }
}

/// NAME.frames.csv: frame,time_s,pressure_kPa,sigma_kPa, one row a frame, time_s the window's middle. sigma_kPa is the
/// standard error of the mean over the cycles and a step of the converter (`resolution_kPa`, 0 if unknown):
///   sigma^2 = sd^2 / cycles + resolution^2 / 12,
/// with sample_sd instead of sd / sqrt(cycles) if there is only one cycle. With `relative`, pressures are those above
/// frame 0's, whose own sigma enters all others.
std::string frames_csv(const runfile::FrameBins& bins, double resolution_kPa, bool relative) {
  const runfile::FrameBin& first = bins.frames.front();
  std::string csv = "frame,time_s,pressure_kPa,sigma_kPa\n";
  for (size_t k = 0; k < bins.frames.size(); ++k) {
    const runfile::FrameBin& bin = bins.frames[k];
    const bool difference = relative && k > 0;
    const double variance = runfile::variance_of_mean(bin, resolution_kPa) +
                            (difference ? runfile::variance_of_mean(first, resolution_kPa) : 0);
    csv += fmt::format("{},{:.6f},{:.6f},{:.6f}\n", k, (bin.window.from_s + bin.window.to_s) / 2,
                       bin.mean_kPa - (relative ? first.mean_kPa : 0), std::sqrt(variance));
  }
  return csv;
}

ExitCode bin(BinOptions options, const CommandOutput& out) {
  if (!options.frames_csv.empty()) require_new_file(options.frames_csv, options.force);
  const runfile::RunFile file = runfile::open_run(options.run);
  const runfile::RecordedRun& run = file.run;
  take_from_schedule(options, run);
  runfile::FrameBinOptions how{.frames = options.frames.value_or(default_frames),
                               .segment = options.segment,
                               .slice = options.slice,
                               .channel = options.channel,
                               .gate_every = options.gate_every.value_or(1)};
  const RemovedDelay delay = delay_asked(options, run);
  how.delay_s = delay.delay_s;
  if (options.real_windows()) {
    how.windows = windows_asked(options, runfile::binned_interval_s(run, how));
  }
  const runfile::FrameBins bins = runfile::bin_frames(run, file.rows, how);
  for (const runfile::ExcludedCycle& cycle : bins.excluded)
    fmt::print(stderr, "cycle {} at {:.3f} s is left out: {}\n", cycle.cycle, cycle.trigger_s, cycle.reason);
  if (!options.frames_csv.empty()) {
    write_text_file(options.frames_csv,
                    frames_csv(bins, runfile::cavity_resolution_kPa(run), options.relative));
  }
  print(out, bins_as_json(options.run, bins, delay), [&] { show_bins(bins, delay); });
  return ExitCode::done;
}

}  // namespace

void add_bin(CommandLine& line) {
  auto options = std::make_shared<BinOptions>();
  CLI::App* command = line.add(
      "bin", "pressure averaged into the image frames of a cycle",
      "  diastole bin gel.run.h5 --frames 16\n"
      "      16 equal frames from each trigger on; sd_kPa is over the cycles\n"
      "  diastole bin gel.run.h5 --frame-times gel.times.csv --frames-csv gel.frames.csv\n"
      "      the frames' times as the images tell them (TriggerTime), in a table with the columns\n"
      "      trigger_time_ms and, if known, width_ms; the pressures as a study's frames file\n"
      "  diastole bin gel.run.h5 --first-ms 12 --tr-ms 70 --frames 16 --json\n"
      "  diastole bin flow.run.h5 --first-ms 8 --tr-ms 36 --frames 64 --gate-every 2\n"
      "      phase contrast: the scanner takes every second R-wave and images two cycles\n"
      "  diastole bin study.run.h5 --slice 3 --frames-csv slice3.frames.csv\n"
      "      the frames that the run's own schedule plans for that slice\n"
      "  diastole bin gel.run.h5 --window 0.00:0.06 --window 0.10:0.16\n"
      "The delay of catheter and filter is removed from real windows, as far as the run states it; equal\n"
      "frames are counted from the trigger as they are, unless --delay-ms is given. A cycle with a missing\n"
      "sample, or whose triggers are not in time, is left out and told; dummy cycles never count.");
  command->add_option("RUN", options->run, "run file")->required();
  command
      ->add_option("--frames", options->frames,
                   "frames in a cycle; default: as the run's schedule plans, else 16")
      ->check(number_between(1, 10000));
  auto* times = command->add_option("--frame-times", options->frame_times,
                                    "CSV with trigger_time_ms and perhaps width_ms, one row a frame");
  auto* tr = command->add_option("--tr-ms", options->tr_ms, "frames begin this far apart")
                 ->check(number_between(0.001, 1e6));
  command->add_option("--first-ms", options->first_ms, "the first frame begins this long after the trigger")
      ->needs(tr);
  auto* window =
      command->add_option("--window", options->windows, "FROM:TO of one frame in seconds; may be repeated");
  times->excludes(tr)->excludes(window);
  tr->excludes(window);
  command->add_option("--width-ms", options->width_ms, "a frame's length, instead of to the next frame")
      ->check(number_between(0.001, 1e6));
  command->add_option("--gate-every", options->gate_every, "the scanner takes every n-th R-wave")
      ->check(number_between(1, 10000));
  command->add_option("--delay-ms", options->delay_ms,
                      "delay of the signal to remove, or \"run\": what the run file tells");
  command->add_option("--segment", options->segment,
                      "segment number, from 0; default: the first with triggers");
  command->add_option("--slice", options->slice, "slice number, from 0; default: all slices of the segment");
  command->add_option("--channel", options->channel, "pressure channel");
  auto* csv = command->add_option("--frames-csv", options->frames_csv,
                                  "also write frame,time_s,pressure_kPa,sigma_kPa for a study");
  command->add_flag("--relative", options->relative, "in that file, pressures above frame 0's")->needs(csv);
  command->add_flag("--force", options->force, "replace that file if it exists");
  line.on_run(command, [options](const CommandOutput& out) { return bin(*options, out); });
}

}  // namespace diastole
