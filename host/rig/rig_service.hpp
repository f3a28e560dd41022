#pragma once
// The rig behind the daemon: one thread owns controller, instrument, clock and journal, and carries out one
// order at a time (order_queue.hpp); everybody else talks to it through this class.
//
// start_run, home, jog, clear_fault and the like occupy the rig from the moment they are accepted (activity: loading,
// running, writing, homing, clearing_fault) and are refused with RigBusy while another does. A stop
// that is asked for after an order was accepted is obeyed by it, at whatever moment: before the start, the
// order is refused.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host/calibration/calibration.hpp"
#include "host/controller/controller_client.hpp"
#include "host/daq/instrument.hpp"
#include "host/journal/journal.hpp"
#include "host/rig/order_queue.hpp"
#include "host/rig/rig.hpp"
#include "host/rig/service_manager.hpp"
#include "host/rig/session_so_far.hpp"

namespace diastole {

struct RigServiceOptions {
  std::string conductor;                   ///< socket of a simulated rig that conducts time; empty: real time
  std::optional<std::string> daq_address;  ///< instead of the rig file's
  std::string producer = "diastole";       ///< program and version, for run files
  ServiceManager* manager = nullptr;       ///< learns that the rig's thread is alive; outlives the service
};

class RigService final : public Rig {
 public:
  /// Opens controller and instrument. Throws HardwareError if one is not there; a controller with a latched fault is:
  /// status shows it, and clear_fault leaves it.
  RigService(RigConfig rig, const RigServiceOptions& options);
  /// Ends a run by a controlled stop, writes what it has, and closes everything.
  ~RigService() override;

  void start_run(RunOrder order, Done done) override;
  void home(Done done) override;
  void clear_fault(Done done) override;
  void jog(double distance_mL, double rate_mL_s, Done done) override;
  void settings(Done done) override;
  void write_settings(SettingsChange change, Done done) override;
  void black_box(Done done) override;
  void self_test(double seconds, Done done) override;
  void calibrate(CalibrationOrder order, Done done) override;
  void status(Done done) override;
  bool stop(StopRequest how) override { return queue_.stop(how); }
  void note(const RunRemark& what) override;
  [[nodiscard]] RunMonitor& run() override { return run_; }
  [[nodiscard]] const LiveTrace& live() const override { return live_; }

  /// Stops now and takes no more orders; what is going on comes to its end. See idle().
  void end() { queue_.end(); }
  /// True when nothing is going on or waiting.
  [[nodiscard]] bool idle() const { return queue_.idle(); }

 private:
  void work(const std::stop_token& stop);
  void idle_turn();
  /// Once, not once a second.
  void log_problem(const std::exception& error);
  /// Runs `work` on a thread of no priority; the line to the controller stays alive meanwhile.
  void beside_the_line(const std::function<void()>& work);
  /// One order answers all who ask until it is carried out.
  void ask(std::vector<Done>& waiting, std::function<RigAnswer()> answer, Done done);
  void carry_out(RigOrder order);
  void reconnect_if_due();
  /// Connects, and reports what was found: a motion that nobody ordered and that was stopped, a latched fault.
  void connect();
  void log_events();
  RigStatus do_home();
  RigStatus do_jog(double distance_mL, double rate_mL_s);
  /// Waits while the controller is in this state, passing on a stop; true if one was asked for.
  bool await_end_of(wire::State moving);
  SettingsReport remember_settings();
  SelfTestResult do_self_test(double seconds);
  CalibrationReport do_calibrate(const CalibrationOrder& order);
  RigStatus do_status();
  RigStatus remember(const wire::Status& status);
  [[nodiscard]] bool asked_to_stop() const { return queue_.stop_asked() != StopRequest::none; }
  [[noreturn]] void refuse_to_start() const;
  /// Throws InputError if the journals' disk cannot hold the run.
  void check_disk(const RunPlan& plan, const daq::RatePlan& rate, int64_t most_cycles);
  /// Removes what need not be kept (host/journal/journal_store.hpp) and counts the rest.
  void tidy_journals();
  void do_run(RunOrder order, const Done& done);
  /// Leaves out what the last session of this experiment has done. Throws InputError if there is none, or nothing is left.
  SessionSoFar resume(Experiment& study);
  void write_beginning(JournalWriter& journal, const RunPlan& run, const RunOrder& order,
                       const ProgramPlan& plan, double sample_rate_Hz,
                       const std::optional<SessionSoFar>& before);
  RunOutcome acquire(JournalWriter& journal, const RunOrder& order, const daq::RatePlan& rate,
                     double planned_s);
  RunResult finish(const std::filesystem::path& journal, const RunOutcome& outcome);

  RigConfig rig_;
  RigServiceOptions options_;
  CalibrationBook book_;  // of the rig's thread
  std::unique_ptr<Clock> clock_;
  std::unique_ptr<daq::Instrument> instrument_;
  std::unique_ptr<GateInputs> gate_;  // null: the rig file has no [gpio], or the rig is simulated
  std::unique_ptr<ControllerClient> controller_;
  uint64_t next_reconnect_ns_ = 0;
  std::string last_problem_;  ///< of the rig's thread between orders: logged once, not once a second

  OrderQueue queue_;
  RunMonitor run_;
  LiveTrace live_;

  mutable InheritingMutex mutex_;  // of what follows
  std::vector<Done> status_requests_, black_box_requests_;
  RigStatus last_status_;
  std::optional<std::string> notice_;  ///< as in status
  KeptJournals journals_;
  SettingsReport last_settings_;

  std::jthread thread_;  // last: it uses the members above
};

}  // namespace diastole
