#include "host/cli/session_view.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <iostream>

namespace diastole {
namespace {

constexpr std::chrono::seconds line_interval{2};
constexpr int64_t bar_cells = 24;

std::string bar(int64_t done, int64_t of) {
  const int64_t filled = of > 0 ? std::min(bar_cells, bar_cells * done / of) : 0;
  return std::string(static_cast<size_t>(filled), '#') +
         std::string(static_cast<size_t>(bar_cells - filled), '.');
}

std::string in_words(const SessionProgress& progress) {
  const double per_cycle_s =
      progress.planned_cycles > 0 ? progress.planned_s / static_cast<double>(progress.planned_cycles) : 0;
  const double left_s = per_cycle_s * static_cast<double>(progress.planned_cycles - progress.triggers);
  return fmt::format("cycle {} of {}, {:.0f} s left, {:.2f} kPa, {} samples, {} missing", progress.triggers,
                     progress.planned_cycles, left_s, progress.last_kPa, progress.samples, progress.gaps);
}

}  // namespace

void SessionView::show(const SessionProgress& progress) {
  for (const std::string& remark : progress.new_remarks) {
    finish();
    fmt::print(stderr, "{}\n", remark);
  }
  if (terminal_) {
    fmt::print(stderr, "\r\033[K[{}] {}", bar(progress.triggers, progress.planned_cycles),
               in_words(progress));
    line_open_ = true;
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (progress.triggers == last_triggers_ || now < next_line_) return;
  last_triggers_ = progress.triggers;
  next_line_ = now + line_interval;
  fmt::print(stderr, "{}\n", in_words(progress));
}

void SessionView::finish() {
  if (std::exchange(line_open_, false)) fmt::print(stderr, "\n");
}

ExitCode exit_code_of(const SessionResult& result) {
  if (!result.regular) return ExitCode::hardware_fault;
  // A stop at once may break a cycle whose trigger is already out; `cycles` counts the whole ones.
  const int64_t broken_cycles = result.triggers - result.cycles;
  const bool triggers_fit = broken_cycles == 0 || (result.end == "stopped_now" && broken_cycles == 1);
  return result.gaps > 0 || !triggers_fit ? ExitCode::negative : ExitCode::done;
}

ExitCode report_session(const SessionResult& result, bool json) {
  if (json) {
    const nlohmann::json document{{"run", result.run},          {"end", result.end},
                                  {"cycles", result.cycles},    {"triggers", result.triggers},
                                  {"samples", result.samples},  {"gaps", result.gaps},
                                  {"expected", result.expected}};
    std::cout << document.dump(2) << '\n';
    return exit_code_of(result);
  }
  fmt::print("{}: {} cycles, {} triggers, {} of {} samples\n", result.run, result.cycles, result.triggers,
             result.samples, result.expected);
  if (result.end != "completed") fmt::print("the run ended early: {}\n", result.end);
  if (result.gaps > 0)
    fmt::print("{} samples are missing; `diastole inspect` tells where and why\n", result.gaps);
  return exit_code_of(result);
}

}  // namespace diastole
