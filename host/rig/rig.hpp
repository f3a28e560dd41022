#pragma once
// The rig as its clients see it: what can be asked of it and ordered (host/rpc/methods.hpp). RigService is the daemon's.

#include <optional>
#include <string>
#include <vector>

#include "host/acquisition/live_trace.hpp"
#include "host/config/experiment.hpp"
#include "host/rig/rig_answers.hpp"
#include "host/rig/run_monitor.hpp"
#include "protocol/runfile/session.hpp"

namespace diastole {

/// Average the channels at rest and keep the result in the calibration file.
struct CalibrationOrder {
  std::vector<std::string> channels;  ///< empty: all
  std::optional<double> kPa;          ///< the pressure that is applied; none: call this zero
  double seconds = 5;
  std::string operator_name;
};

struct RunOrder {
  Experiment experiment;
  bool prompts_answered = false;  ///< AcquisitionSetup::prompts_answered
  bool resume = false;            ///< the last session of this experiment goes on with what is not done
  runfile::Session session = {};  ///< a note without author or time is the operator's, of the run's start
};

struct SettingsChange {
  bool defaults = false;  ///< begin with the initial ones
  Attributes set;
};

/// `done` is called once, now or later and on any thread: with an error or with the answer that is named. An order may throw
/// RigBusy or HardwareError instead.
class Rig {
 public:
  using Done = RigDone;

  virtual ~Rig() = default;

  /// Loads and starts an experiment, or what is left of its last session. `done` is called with RunBegun when the controller has accepted it, or with
  /// InputError when it cannot be done, HardwareError when it was stopped before the start.
  virtual void start_run(RunOrder order, Done done) = 0;
  /// RigStatus, as the next two.
  virtual void home(Done done) = 0;
  virtual void clear_fault(Done done) = 0;
  /// Relative, inflate positive; `done` when it is at rest again.
  virtual void jog(double distance_mL, double rate_mL_s, Done done) = 0;
  /// SettingsReport. While the rig is occupied, as they were last read.
  virtual void settings(Done done) = 0;
  /// `done` with what settings() then answers. The pump is unhomed afterwards.
  virtual void write_settings(SettingsChange change, Done done) = 0;
  /// BlackBox. Throws RigBusy while the rig is occupied; does not occupy it.
  virtual void black_box(Done done) = 0;
  /// SelfTestResult: the controller's measurements over loop-back wires, and the clocks compared for so long. HardwareError if
  /// its motor is powered.
  virtual void self_test(double seconds, Done done) = 0;
  /// CalibrationReport. HardwareError, and nothing changed, when samples are missing, or noise or drift is too high for
  /// rest.
  virtual void calibrate(CalibrationOrder order, Done done) = 0;
  /// RigStatus. While the rig is occupied the answer comes at once, from what the controller last reported.
  virtual void status(Done done) = 0;
  /// Stops what moves or is about to; without anything, `false`.
  virtual bool stop(StopRequest how) = 0;
  /// Writes to the log, and while a run is on to its events.
  virtual void note(const RunRemark& what) = 0;
  /// The present or last run.
  [[nodiscard]] virtual RunMonitor& run() = 0;
  /// Its newest pressure.
  [[nodiscard]] virtual const LiveTrace& live() const = 0;
};

}  // namespace diastole
