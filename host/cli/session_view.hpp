#pragma once
// How a running session and its result are shown to a person; also for `diastole simulate`.

#include <chrono>
#include <string>

#include "host/daemon/run_session.hpp"
#include "protocol/contract/exit_code.hpp"

namespace diastole {

/// Progress on standard error: one line that renews itself on a terminal, a plain line every few seconds
/// otherwise.
class SessionView {
 public:
  explicit SessionView(bool terminal) : terminal_(terminal) {}
  void show(const SessionProgress& progress);
  /// Ends the renewed line, if there is one.
  void finish();

 private:
  bool terminal_;
  bool line_open_ = false;
  int64_t last_triggers_ = -1;
  std::chrono::steady_clock::time_point next_line_{};
};

/// The result in words, or as one JSON document with `run`, `end`, `cycles`, `triggers`, `samples`, `gaps`,
/// `expected`. Returns the exit code that goes with it.
ExitCode report_session(const SessionResult& result, bool json);
ExitCode exit_code_of(const SessionResult& result);

}  // namespace diastole
