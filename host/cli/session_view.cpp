#include "host/cli/session_view.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "host/cli/daemon_question.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

/// "26 min 10 s"
std::string duration_words(double duration_s) {
  const auto seconds = static_cast<int64_t>(std::llround(duration_s));
  if (seconds < 60) return fmt::format("{} s", seconds);
  if (seconds < 3600) return fmt::format("{} min {} s", seconds / 60, seconds % 60);
  return fmt::format("{} h {} min", seconds / 3600, seconds % 3600 / 60);
}

std::string block_words(const Experiment& experiment, const ScheduleBlock& block) {
  const Schedule& schedule = *experiment.schedule;
  const int64_t cycles = block.slices * (schedule.dummy_cycles + block.cycles_per_slice);
  return fmt::format(
      "  {}: {} slice{} of {} cycles{}, {}{}\n", block.name, block.slices, block.slices == 1 ? "" : "s",
      block.cycles_per_slice,
      schedule.dummy_cycles > 0 ? fmt::format(" after {} dummy cycles", schedule.dummy_cycles) : "",
      duration_words(experiment.segments.front().period_s * static_cast<double>(cycles)),
      block.prompt.empty() ? "" : ", each waits for you");
}

constexpr std::chrono::seconds line_interval{2};
constexpr int64_t bar_cells = 24;
constexpr size_t trace_cells = 48;
constexpr double least_span_kPa = 0.1;  // noise at rest shall not look like a cycle

std::string bar(int64_t done, int64_t of) {
  const int64_t filled = of > 0 ? std::min(bar_cells, bar_cells * done / of) : 0;
  return std::string(static_cast<size_t>(filled), '#') +
         std::string(static_cast<size_t>(bar_cells - filled), '.');
}

double left_s(const SessionProgress& progress) {
  if (progress.planned_cycles == 0) return 0;
  const int64_t left =
      progress.schedule ? progress.schedule->cycles_left : progress.planned_cycles - progress.triggers;
  return progress.planned_s / static_cast<double>(progress.planned_cycles) * static_cast<double>(left);
}

int64_t cycles_done(const SessionProgress& progress) {
  return progress.schedule ? progress.planned_cycles - progress.schedule->cycles_left : progress.triggers;
}

std::string slice_words(const SessionProgress& progress) {
  const ScheduleProgress& schedule = *progress.schedule;
  const bool before_first_cycle = progress.triggers == 0 && schedule.phase != "waiting";
  return fmt::format("slice {} of {} ({}): {}", schedule.slice + 1, schedule.slices, schedule.block,
                     before_first_cycle ? "at rest before the first cycle" : schedule.phase);
}

/// Two decimals, and no minus before a zero.
std::string pressure_words(double pressure_kPa) {
  const double shown_kPa = std::round(100 * pressure_kPa) / 100;
  return fmt::format("{:.2f} kPa", shown_kPa == 0 ? 0.0 : shown_kPa);
}

/// The first `columns` characters of UTF-8 text, each one column wide.
std::string clipped(const std::string& text, size_t columns) {
  size_t end = 0;
  for (size_t characters = 0; end < text.size(); ++end) {
    if (begins_character(text[end]) && characters++ == columns) break;
  }
  return text.substr(0, end);
}

size_t terminal_columns() {
  constexpr size_t usual = 80;
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : usual;
}

std::string in_words(const SessionProgress& progress) {
  return fmt::format("cycle {} of {}, {} left, {}{}, {} triggers, {} samples, {} missing",
                     cycles_done(progress), progress.planned_cycles, duration_words(left_s(progress)),
                     progress.schedule ? slice_words(progress) + ", " : "",
                     pressure_words(progress.filtered_kPa), progress.triggers, progress.samples,
                     progress.gaps);
}

std::string sparkline(const std::deque<double>& trace_kPa) {
  static constexpr std::array<const char*, 8> heights{"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  std::string line;
  if (trace_kPa.empty()) return line;
  const auto [least, most] = std::ranges::minmax(trace_kPa);
  const double span_kPa = std::max(most - least, least_span_kPa);
  for (const double value_kPa : trace_kPa) {
    const double height = (value_kPa - least) / span_kPa * static_cast<double>(heights.size() - 1);
    line += heights[static_cast<size_t>(std::lround(height))];
  }
  return line;
}

}  // namespace

std::vector<std::string> view_lines(const SessionProgress& progress, const std::deque<double>& trace_kPa,
                                    size_t columns) {
  std::vector<std::string> lines{fmt::format(
      "[{}] cycle {} of {}, {} left, {} triggers", bar(cycles_done(progress), progress.planned_cycles),
      cycles_done(progress), progress.planned_cycles, duration_words(left_s(progress)), progress.triggers)};
  if (progress.schedule) lines.push_back(slice_words(progress));
  if (progress.schedule && !progress.schedule->prompt.empty()) {
    lines.push_back(progress.schedule->prompt + "  [Enter, or `diastole continue`]");
  }
  lines.push_back(fmt::format("{}  {}   {} samples, {} missing", sparkline(trace_kPa),
                              pressure_words(progress.filtered_kPa), progress.samples, progress.gaps));
  for (std::string& line : lines)
    line = clipped(line, columns);
  return lines;
}

void SessionView::redraw(const SessionProgress& progress) {
  trace_kPa_.push_back(std::isfinite(progress.filtered_kPa) ? progress.filtered_kPa : progress.last_kPa);
  if (trace_kPa_.size() > trace_cells) trace_kPa_.pop_front();
  wipe();
  const std::vector<std::string> lines = view_lines(progress, trace_kPa_, terminal_columns());
  fmt::print(stderr, "{}", fmt::join(lines, "\n"));
  lines_open_ = static_cast<int>(lines.size());
}

void SessionView::wipe() {
  const int up = std::max(0, std::exchange(lines_open_, 0) - 1) + std::exchange(lines_entered_, 0);
  if (up > 0) fmt::print(stderr, "\033[{}A", up);
  fmt::print(stderr, "\r\033[J");  // to the screen's end
}

void SessionView::show(const SessionProgress& progress) {
  if (terminal_ && !progress.new_remarks.empty()) wipe();
  for (const std::string& remark : progress.new_remarks)
    fmt::print(stderr, "{}\n", remark);
  if (terminal_) return redraw(progress);
  const auto now = std::chrono::steady_clock::now();
  if (progress.triggers == last_triggers_ || now < next_line_) return;
  last_triggers_ = progress.triggers;
  next_line_ = now + line_interval;
  fmt::print(stderr, "{}\n", in_words(progress));
}

void SessionView::finish() {
  if (std::exchange(lines_open_, 0) > 0) fmt::print(stderr, "\n");
}

ExitCode exit_code_of(const SessionResult& result) {
  if (!result.regular) return ExitCode::hardware_fault;
  // A stop at once may break a cycle whose trigger is already out; `cycles` counts the whole ones.
  const int64_t broken_cycles = result.triggers - result.cycles;
  const bool triggers_fit = broken_cycles == 0 || (result.end == "stopped_now" && broken_cycles == 1);
  return result.gaps > 0 || result.errors > 0 || !triggers_fit ? ExitCode::negative : ExitCode::done;
}

ExitCode report_session(const SessionResult& result, bool json) {
  if (json) {
    print_json({DIASTOLE_NAMED(result, run, end, cycles, triggers, samples, gaps, expected, errors)});
    return exit_code_of(result);
  }
  fmt::print("{}: {} cycles, {} triggers, {} of {} samples\n", result.run, result.cycles, result.triggers,
             result.samples, result.expected);
  if (result.end != "completed") fmt::print("the run ended early: {}\n", result.end);
  if (result.gaps > 0)
    fmt::print("{} samples are missing; `diastole inspect` says where and why\n", result.gaps);
  if (result.errors > 0) {
    fmt::print("{} errors were noted; `diastole inspect` lists them\n", result.errors);
  }
  return exit_code_of(result);
}

std::string plan_words(const Experiment& experiment) {
  std::string words;
  if (experiment.schedule) {
    for (const ScheduleBlock& block : experiment.schedule->blocks)
      words += block_words(experiment, block);
  } else {
    for (const ExperimentSegment& segment : experiment.segments) {
      words += fmt::format("  {} x {} of {:g} mL in {:g} s\n", segment.cycles, segment.waveform_name,
                           segment.stroke_mL, segment.period_s);
    }
  }
  words += fmt::format("{} cycles, about {}", experiment.planned_cycles(),
                       duration_words(experiment.estimate_s()));
  if (experiment.schedule && experiment.schedule->waits()) words += ", and the time of waiting for you";
  return words + "\n";
}

nlohmann::json plan_json(const Experiment& experiment) {
  nlohmann::json blocks = nlohmann::json::array();
  if (experiment.schedule) {
    for (const ScheduleBlock& block : experiment.schedule->blocks) {
      blocks.push_back(
          {DIASTOLE_NAMED(block, name, slices, cycles_per_slice), {"waits", !block.prompt.empty()}});
    }
  }
  return {{"experiment", experiment.file},
          {"cycles", experiment.planned_cycles()},
          {"estimate_s", experiment.estimate_s()},
          {"slices", experiment.schedule ? experiment.schedule->slices() : 0},
          {"waits", experiment.schedule && experiment.schedule->waits()},
          {"blocks", blocks}};
}

}  // namespace diastole
