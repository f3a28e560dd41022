#pragma once
// The rig behind the daemon: one thread owns controller, instrument, clock and journal, and carries out one
// order at a time; everybody else talks to it through this class.
//
// start_run, home, jog, clear_fault and the like occupy the rig from the moment they are accepted (activity: loading,
// running, writing, homing, clearing_fault) and are refused with rpc::Error busy while another does. A stop
// that is asked for after an order was accepted is obeyed by it, at whatever moment: before the start, the
// order is refused.

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/acquisition/acquisition.hpp"
#include "host/acquisition/live_trace.hpp"
#include "host/calibration/calibration.hpp"
#include "host/config/experiment.hpp"
#include "host/config/rig_config.hpp"
#include "host/controller/controller_client.hpp"
#include "host/daemon/remark_log.hpp"
#include "host/daemon/service_manager.hpp"
#include "host/daq/instrument.hpp"
#include "host/transport/clock.hpp"
#include "host/transport/real_time.hpp"

namespace diastole {

struct RigServiceOptions {
  std::string conductor;                   ///< socket of a simulated rig that conducts time; empty: real time
  std::optional<std::string> daq_address;  ///< instead of the rig file's
  std::string producer = "diastole";       ///< program and version, for run files
  ServiceManager* manager = nullptr;       ///< told that the rig's thread is alive; outlives the service
};

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
};

class RigService {
 public:
  /// Called once on the rig's thread: with an error, or with a result.
  using Done = std::function<void(std::exception_ptr error, nlohmann::json result)>;

  static constexpr size_t remarks_at_once = 200;

  /// Opens controller and instrument. Throws HardwareError if one is not there; a controller with a latched fault is:
  /// status tells it, and clear_fault leaves it.
  RigService(RigConfig rig, const RigServiceOptions& options);
  /// Ends a run by a controlled stop, writes what it has, and closes everything.
  ~RigService();

  /// Loads and starts an experiment. `done` is called when the controller has accepted it and the run begins
  /// ({"run_id", "journal", "run_file"}: where it is being written, and what is made of it at the end), or with
  /// InputError when it cannot be done, HardwareError when it was stopped before the start.
  void start_run(RunOrder order, Done done);
  void home(Done done);
  void clear_fault(Done done);
  /// Relative, inflate positive; `done` when it is at rest again.
  void jog(double distance_mL, double rate_mL_s, Done done);
  /// {"record": 0 if never written, "settings": {name: value}, "microstep_uL", "backlash_microsteps", "problem":
  /// where the rig file disagrees, or null}. While the rig is occupied, as they were last read.
  void settings(Done done);
  struct SettingsChange {
    bool defaults = false;  ///< begin with the initial ones
    nlohmann::json set;     ///< {name: value}
  };
  /// `done` with what settings() then tells. The pump is unhomed afterwards.
  void write_settings(SettingsChange change, Done done);
  /// {"entries": [{"number", "boot", "time_s", "kind", "text"}], oldest first, "since_power_on"}. Throws rpc::Error busy
  /// while the rig is occupied; does not occupy it.
  void black_box(Done done);
  /// {"file", "channels": [{"name", "samples", "mean_V", "noise_kPa", "drift_kPa", "points", "kPa_per_V", "zero_V"}]}.
  /// HardwareError, and nothing changed, when samples are missing, or noise or drift is too high for rest.
  void calibrate(CalibrationOrder order, Done done);
  /// {"state", "fault", "firmware", "position_mL", "notice": that the pump was found moving and was stopped, until the
  /// next order, else null, ...}. While the rig is occupied `state` is the activity, and
  /// the answer comes at once, from what the controller last told.
  void status(Done done);
  /// Stops what moves or is about to; without anything, `false`.
  bool stop(StopRequest how);
  /// The operator is ready for the slice that the run waits for, or for slice number `slice` if it is that one.
  /// {"continued", "slice", "prompt"}: whether one was waited for.
  nlohmann::json continue_run(std::optional<size_t> slice);
  /// Stops now and takes no more orders; what is going on comes to its end. See idle().
  void end();
  /// True when nothing is going on or waiting.
  [[nodiscard]] bool idle() const;
  /// Tells the log, and while a run is on its events and whoever follows it.
  void note(const RunRemark& what);
  /// The present or last run: {"run_id", "state": running|writing|done|failed, "received", "missing",
  /// "triggers", "gate_pulses" (null if not counted), "last_kPa", "filtered_kPa", "schedule" (null without one),
  /// "remarks": as RemarkLog gives them, at most remarks_at_once from number `first_remark` on, "next_remark": the
  /// number to ask for next, "result"}. null if there was none.
  [[nodiscard]] nlohmann::json run_progress(size_t first_remark) const;
  /// The newest pressure of the present or last run.
  [[nodiscard]] const LiveTrace& live() const { return live_; }

 private:
  struct Order {
    std::string activity;  ///< empty: does not occupy the rig
    std::function<nlohmann::json()> act;
    Done done;
  };
  struct RunRecord {
    std::string run_id;
    std::string state = "running";
    double planned_s = 0;   ///< the controller's program, with what a schedule allows for waiting
    double estimate_s = 0;  ///< without that
    int64_t planned_cycles = 0;
    RunProgress progress;
    RemarkLog remarks;
    nlohmann::json result;
  };

  void work(const std::stop_token& stop);
  void idle_turn();
  /// Once, not once a second.
  void tell_problem(const std::exception& error);
  /// Runs `work` on a thread of no priority; the line to the controller stays alive meanwhile.
  void beside_the_line(const std::function<void()>& work);
  void give(Order order);
  /// One order answers all who ask until it is carried out.
  void ask(std::vector<Done>& askers, nlohmann::json (RigService::*answer)(), Done done);
  void keep(const RunRemark& remark);
  [[nodiscard]] std::optional<Order> next_order();
  void carry_out(Order order);
  void reconnect_if_due();
  /// Connects, and tells what was found: a motion that nobody ordered and that was stopped, a latched fault.
  void connect();
  void tell_events();
  nlohmann::json do_home();
  nlohmann::json do_jog(double distance_mL, double rate_mL_s);
  /// Waits while the controller is in this state, passing on a stop; true if one was asked for.
  bool await_end_of(wire::State moving);
  nlohmann::json remember_settings();
  nlohmann::json do_black_box();
  nlohmann::json do_calibrate(const CalibrationOrder& order);
  nlohmann::json do_status();
  nlohmann::json remember(const wire::Status& status);
  [[nodiscard]] bool asked_to_stop() const;
  [[noreturn]] void refuse_to_start() const;
  [[noreturn]] void refuse_after_motion() const;
  bool begin(const RunRecord& record);
  /// Throws InputError if the journals' disk cannot hold the run.
  void check_disk(const RunRecord& record, const daq::RatePlan& rate, int64_t most_cycles);
  /// Removes what need not be kept (journal_store.hpp) and counts the rest.
  void tidy_journals();
  void do_run(const RunOrder& order, const Done& done);
  void write_beginning(JournalWriter& journal, const RunRecord& record, const Experiment& experiment,
                       const ProgramPlan& plan, double sample_rate_Hz);
  RunOutcome acquire(JournalWriter& journal, const RunOrder& order, const daq::RatePlan& rate,
                     double planned_s);
  nlohmann::json finish(const std::filesystem::path& journal, const RunOutcome& outcome);

  RigConfig rig_;
  RigServiceOptions options_;
  CalibrationBook book_;  // of the rig's thread
  std::unique_ptr<Clock> clock_;
  std::unique_ptr<daq::Instrument> instrument_;
  std::unique_ptr<GateInputs> gate_;  // null: the rig file has no [gpio], or the rig is simulated
  std::unique_ptr<ControllerClient> controller_;
  uint64_t next_reconnect_ns_ = 0;
  std::string last_problem_;  ///< of the rig's thread between orders: told once, not once a second

  mutable InheritingMutex mutex_;  // the server's thread, which has no priority, holds it too
  std::condition_variable_any wake_;
  std::deque<Order> orders_;
  std::vector<Done> status_askers_, black_box_askers_;
  std::vector<RunRemark> notes_;  // for the run that is on
  std::string activity_;          // empty: none
  bool ending_ = false;
  StopRequest stop_request_ = StopRequest::none;
  std::optional<size_t> go_on_;  // the slice that the operator is ready for
  std::optional<RunRecord> run_;
  LiveTrace live_;
  nlohmann::json last_status_;
  nlohmann::json notice_;  ///< as in status
  nlohmann::json journals_;
  nlohmann::json last_settings_;
  std::jthread thread_;  // last: it uses the members above
};

}  // namespace diastole
