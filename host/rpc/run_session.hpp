#pragma once
// One experiment through the daemon, from file to run file: what `diastole run` and `diastole simulate` do.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/acquisition/acquisition.hpp"
#include "host/rpc/client.hpp"

namespace diastole {

struct SessionProgress {
  double planned_s = 0;
  int64_t planned_cycles = 0;
  int64_t triggers = 0;
  int64_t samples = 0;
  int64_t gaps = 0;
  double last_kPa = 0;
  double filtered_kPa = 0;
  std::optional<ScheduleProgress> schedule;
  std::vector<std::string> new_remarks;  ///< since the last call: faults, gaps, stops, in plain words
};

/// What is stated of the session and kept in the run file's /session; empty: not stated.
struct SessionFacts {
  std::string specimen;
  std::string operator_name;
  std::optional<double> room_temperature_C;
  std::vector<std::string> notes;
};

struct SessionOptions {
  std::string experiment;  ///< file
  std::string output;      ///< run file
  bool force = false;      ///< replace an existing output
  bool resume = false;     ///< the daemon's last session of this experiment goes on
  SessionFacts facts = {};
  int poll_ms = 100;  ///< between questions for progress
  std::function<void(const SessionProgress&)> progress = [](const SessionProgress&) {};
  /// Whether the operator has said since the last question that he is ready; asked with every question for progress.
  std::function<bool()> ready = [] { return false; };
  bool prompts_answered = false;  ///< nobody is waited for: the daemon goes on at each prompt by itself
  /// How often the user has asked to stop (Ctrl-C): 1 at the cycle's end, 2 or more now.
  std::function<int()> stops_asked = [] { return 0; };
};

struct SessionResult {
  std::string run;       ///< the output file
  std::string end;       ///< "completed", "stopped_at_cycle_end", "stopped_now", or what went wrong
  bool regular = false;  ///< it ended as planned or as asked
  int64_t cycles = 0;
  int64_t triggers = 0;
  int64_t samples = 0;
  int64_t gaps = 0;
  int64_t expected = 0;
  int64_t errors = 0;  ///< events of level "error" in the run file, such as witnesses that disagree
};

/// Throws InputError before anything moves: unreadable or impossible experiment, output exists or its
/// directory cannot be written. Throws HardwareError when no run file came out of it; it then names the
/// journal.
SessionResult run_session(DaemonClient& daemon, const SessionOptions& options);

}  // namespace diastole
