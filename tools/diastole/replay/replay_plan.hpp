#pragma once
// What a recorded run says about how to do it again: the experiment, the rig, the clocks, and what happened on the way.
//
// Exactly as they were: experiment, machine settings, limits (where the file holds them), the place of the piston at
// the start, the drift of host and instrument against the controller, every missing sample, stops, the operator's
// starts of slices, and faults of switches and cables at their time. What cannot be known from the file is assumed and
// reported in `remarks`.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::replay {

/// What somebody asked the daemon for during the run.
struct Order {
  enum class Kind { stop_at_cycle_end, stop_now, halt, go_on } kind{};
  double time_s = 0;  ///< since the start of run
  size_t slice = 0;   ///< of go_on
};

struct ReplayPlan {
  std::string experiment_toml;
  std::map<std::string, std::string> points;  ///< files beside it: name and text
  std::string rig_toml;
  std::map<std::string, double> settings;  ///< to be written into the controller; empty: as it comes
  double start_mL = 0;                     ///< where the piston stands before the run, from home
  double host_drift_ppm = 0;
  std::vector<std::string> faults;  ///< for sim_rig --fault
  std::vector<Order> orders;        ///< in order of time
  std::vector<std::string> remarks;
};

struct PlanOptions {
  std::optional<MotionLimits> limits = {};  ///< instead of those of the file
  double onset_shift_s = 0;  ///< of what began at an unknown time: a silence of the host, a reset
};

/// Throws InputError that says what the file lacks.
ReplayPlan plan_replay(const runfile::RunFile& run, const PlanOptions& options = {});

/// What shows that something began before, at a time that the file does not hold: lease_lost, or the loss of a
/// controller that was reset.
std::optional<runfile::Event> late_sign(const runfile::RecordedRun& run);

// Its parts.
void plan_experiment(const runfile::RunFile& run, ReplayPlan& plan);
void plan_rig(const runfile::RunFile& run, const std::optional<MotionLimits>& limits, ReplayPlan& plan);
void plan_happenings(const runfile::RunFile& run, double onset_shift_s, ReplayPlan& plan);

/// A number of /rig, if it is there.
std::optional<double> rig_number(const runfile::RecordedRun& run, const std::string& name);

/// Why a run ended: "completed", "stopped_at_cycle_end", "link_lost", "faulted: estop", "incomplete", ...
std::string end_of(const runfile::RecordedRun& run);
/// Whether an event is a fault that the controller latched, by its code.
bool is_controller_fault(const std::string& code);

}  // namespace diastole::replay
