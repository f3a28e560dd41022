#pragma once
// How a running session and its result are shown to a person, also for `diastole simulate`; and, before anything moves,
// what an experiment will do and how long it takes.

#include <chrono>
#include <deque>
#include <nlohmann/json.hpp>
#include <string>

#include "host/config/experiment.hpp"
#include "host/rpc/run_session.hpp"
#include "protocol/contract/exit_code.hpp"

namespace diastole {

/// Progress on standard error. On a terminal a few lines that renew themselves,
///
///   [########................] cycle 412 of 1276, 17 min 17 s left
///   slice 11 of 25 (tagged): imaging
///   ▁▂▃▅▇█▇▅▃▂▁▁▂▃▅▇   3.12 kPa   123600 samples, 0 missing
///
/// the pressure over the last seconds, low-passed, between its least and largest. Otherwise a plain line every few
/// seconds, and one for every prompt. Remarks (faults, gaps, slices) stay above as plain lines.
class SessionView {
 public:
  explicit SessionView(bool terminal) : terminal_(terminal) {}
  void show(const SessionProgress& progress);
  /// Records that the operator's own key presses have moved the cursor down by so many lines.
  void entered(int lines) { lines_entered_ += lines; }
  /// Ends the renewed lines, if there are any.
  void finish();

 private:
  void redraw(const SessionProgress& progress);
  /// Takes the renewed lines off the screen.
  void wipe();

  bool terminal_;
  int lines_open_ = 0;
  int lines_entered_ = 0;
  std::deque<double> trace_kPa_;
  int64_t last_triggers_ = -1;
  std::chrono::steady_clock::time_point next_line_{};
};

/// The present lines of the view, one string each, without control characters, at most `columns` wide.
std::vector<std::string> view_lines(const SessionProgress& progress, const std::deque<double>& trace_kPa,
                                    size_t columns = 200);

/// The result in words, or as one JSON document with `run`, `end`, `cycles`, `triggers`, `samples`, `gaps`,
/// `expected`. Returns the exit code that goes with it.
ExitCode report_session(const SessionResult& result, bool json);
ExitCode exit_code_of(const SessionResult& result);

/// One line a block of the schedule (or a segment), and the whole.
std::string plan_words(const Experiment& experiment);

/// {"cycles", "estimate_s", "slices", "waits", "blocks": [...]}
nlohmann::json plan_json(const Experiment& experiment);

}  // namespace diastole
