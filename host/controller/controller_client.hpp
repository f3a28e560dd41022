#pragma once
// The controller over its serial line, order by order: agrees on the protocol, loads, starts, stops. The session itself
// keeps controller_link.hpp, questions and answers requests.hpp, what is reported telemetry_intake.hpp.

#include <functional>
#include <memory>
#include <optional>

#include "host/config/experiment.hpp"
#include "host/config/rig_config.hpp"
#include "host/controller/requests.hpp"
#include "host/controller/telemetry_intake.hpp"
#include "host/transport/clock.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

/// What an armed program will do, as the controller planned it.
using ProgramPlan = std::vector<wire::SegmentPlanned>;

class ControllerClient final : public Controller {
 public:
  using OpenLine = std::function<std::unique_ptr<ByteLine>()>;

  ControllerClient(Clock& clock, const RigConfig& rig, OpenLine open_line);

  /// Opens the line, checks that both sides speak the same protocol, stops a motion that goes on (found_moving()),
  /// reads the controller's settings, and sends geometry and limits if they agree with the rig file; if not, orders
  /// to move throw settings_problem(). A faulted controller takes none before clear_fault(). Throws
  /// HardwareError with the remedy in words, InputError if a number of the rig file is beyond what the protocol can
  /// carry; it is not connected then, and no heartbeat of this client prolongs a motion.
  void connect();
  void disconnect();
  [[nodiscard]] bool connected() const { return link_.has_line() && hello_.has_value(); }
  /// What the controller was doing when connect() found it moving by nobody's order in this connection, and stopped
  /// it under control; none if it was at rest.
  [[nodiscard]] const std::optional<wire::State>& found_moving() const { return found_moving_; }
  /// Whether the controller has geometry and limits; not while it is faulted since before connect().
  [[nodiscard]] bool configured() const { return configured_; }
  /// Of the controller that answered; precondition: connected().
  [[nodiscard]] const wire::Hello& hello() const { return *hello_; }
  /// Calibrated if the controller's settings were ever written.
  [[nodiscard]] uint32_t microstep_pL() const { return microstep_pL_; }
  /// Of the program that was loaded last.
  [[nodiscard]] double position_rate_Hz() const { return position_rate_Hz_; }
  /// What the controller keeps in its flash.
  [[nodiscard]] const wire::SettingsReport& settings() const { return settings_; }
  /// Where rig file and settings disagree.
  [[nodiscard]] const std::optional<InputFault>& settings_problem() const { return settings_problem_; }
  /// Replaces them; only at rest, and the pump is unhomed afterwards. Throws InputError, HardwareError.
  void write_settings(const wire::MachineSettings& settings);
  /// The last events, oldest first, over resets.
  std::vector<wire::BlackBoxEntry> black_box();

  /// Loads and checks a whole program; afterwards the controller is armed, and will report positions at the
  /// sample rate, but no slower than 300 Hz and no faster than 1000 Hz. A program beyond a limit throws
  /// InputError naming the experiment's segment, the limit, what was asked and what is allowed; so does one
  /// whose reports are more than the line's baud rate carries.
  ProgramPlan load(const Experiment& experiment);
  /// Forgets the program; an armed controller is then homed.
  void unload();
  void home();
  /// Moves by `distance_mL`, inflate positive. Throws InputError with the limit that it would exceed.
  void jog(double distance_mL, double rate_mL_s);
  /// Sends geometry and limits too if connect() could not.
  void clear_fault();
  wire::Status status();
  /// The last status, brought forward by the events since: state, fault, position, segment, cycle, triggers and
  /// R-waves are of now, or a batch of positions old. In a run service() asks for it twice a second: the rest is no
  /// older than that.
  [[nodiscard]] const wire::Status& last_known() const { return telemetry_.last_known(); }

  void service() override { link_.service(); }
  [[nodiscard]] uint64_t next_due_ns() const override { return link_.next_due_ns(); }
  std::vector<ControllerEvent> take_events() override { return telemetry_.take_events(); }
  void start() override;
  void stop_at_cycle_end() override;
  void stop_now() override;
  void halt() override;
  ByteLine* line() override { return link_.line(); }

 private:
  void take(const wire::Received& received);
  void greet();
  void read_settings();
  void stop_what_moves();
  void configure_if_possible();
  void configure();
  void upload(const Experiment& experiment);
  /// Throws unless the controller has settings that agree with the rig file, and the file's limits.
  void require_configuration() const;
  void ask_status_if_due();

  Clock& clock_;
  const RigConfig& rig_;
  OpenLine open_line_;
  ControllerLink link_;
  Requests requests_;
  TelemetryIntake telemetry_;
  std::optional<wire::Hello> hello_;
  uint32_t microstep_pL_ = 0;
  double position_rate_Hz_ = 0;
  wire::SettingsReport settings_;
  std::optional<InputFault> settings_problem_;
  std::optional<wire::State> found_moving_;
  bool configured_ = false;
  uint64_t next_status_question_ns_ = 0;
  ProgramPlan plan_;
};

}  // namespace diastole
