#pragma once
// One run: takes in the samples of a SampleSource and the controller's events, and writes both to the journal,
// until the controller says that the run has ended, and a quarter of a second more: the last cycle, which
// counts from its trigger, ends a little after the last step.
//
// A source gives every index as received or as missing (sample_source.hpp); `RunOutcome` counts them. At the end the
// count is held against the clock: how many were due from the first to the last moment.
//
// The loop is single-threaded in time: it reads and waits for time through one Clock only.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/acquisition/live_trace.hpp"
#include "host/acquisition/sample_source.hpp"
#include "host/config/rig_config.hpp"
#include "host/config/schedule.hpp"
#include "host/controller/controller.hpp"
#include "host/gpio/gate_inputs.hpp"
#include "host/journal/journal_records.hpp"
#include "host/transport/clock.hpp"

namespace diastole {

enum class StopRequest { none, at_cycle_end, now, halt };  // the later wins

/// A remark for the person in front: what the run file's /events will hold.
struct RunRemark {
  std::string level;  ///< "info", "warning", "error"
  std::string code;
  std::string text;
};

/// Where a run with a schedule is.
struct ScheduleProgress {
  std::string block;
  int64_t slice = 0;  ///< of all slices
  int64_t slices = 0;
  std::string phase;  ///< "waiting", "dummy", "imaging", "pause", "done"
  int64_t cycles_left = 0;
  std::string prompt;  ///< what is waited for
};

struct RunProgress {
  uint64_t received = 0;  ///< samples
  uint64_t missing = 0;
  uint64_t triggers = 0;
  std::optional<uint64_t> gate_pulses;  ///< that the host itself counted on the gating line
  uint64_t saturated = 0;               ///< values at the end of the instrument's range, all channels
  double last_kPa = 0;                  ///< of the first channel
  double filtered_kPa = 0;              ///< the same, low-passed forward, some 13 ms late (low_pass.hpp)
  std::optional<ScheduleProgress> schedule;
};

struct RunOutcome {
  std::string end;  ///< "completed", "stopped_at_cycle_end", ..., "link_lost", "journal_failed"
  uint32_t cycles = 0;
  RunProgress counts;
  std::string first_error;  ///< the first remark of level "error"; empty: none
  [[nodiscard]] bool regular() const {
    return end == "completed" || end == "stopped_at_cycle_end" || end == "stopped_now";
  }
};

struct AcquisitionSetup {
  double sample_rate_Hz = 300;  ///< that the instrument keeps (Instrument::plan_rate)
  std::vector<ChannelConfig> channels;
  std::vector<std::string> warnings;      ///< to remark at the start
  GateInputs* gate = nullptr;             ///< what the host sees of gating line and emergency stop, or null
  double planned_duration_s = 0;          ///< a run that has not ended well after this is broken off
  std::vector<PlannedSlice> slices = {};  ///< empty: no schedule
  LiveTrace* live = nullptr;              ///< shown to whoever looks on, or null
  bool prompts_answered = false;  ///< the operator is waited for nowhere: each prompt is answered at once
};

struct AcquisitionHooks {
  std::function<StopRequest()> stop = [] { return StopRequest::none; };  ///< asked once a turn
  /// The slice for which the operator has said that the scanner is ready, once; asked while one is waited for.
  std::function<std::optional<size_t>()> go_on = [] { return std::optional<size_t>(); };
  /// What others want in the run's events; asked once a turn.
  std::function<std::vector<RunRemark>()> notes = [] { return std::vector<RunRemark>(); };
  std::function<void(const RunProgress&)> progress = [](const RunProgress&) {};
  std::function<void(const RunRemark&)> remark = [](const RunRemark&) {};
};

/// Starts the armed program and returns when it has ended, one way or another. When the disk takes no more
/// ("journal_failed"), it has the pump stopped under control and waits for that.
RunOutcome acquire(Clock& clock, Controller& controller, SampleSource& samples, JournalWriter& journal,
                   AcquisitionSetup setup, const AcquisitionHooks& hooks);

}  // namespace diastole
