#pragma once
// The controller over its serial line, order by order: agrees on the protocol, loads, starts, stops. The session itself
// keeps controller_link.hpp, questions and answers requests.hpp, what is reported telemetry_intake.hpp.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

#include "host/config/experiment.hpp"
#include "host/config/rig_config.hpp"
#include "host/controller/controller_words.hpp"
#include "host/controller/requests.hpp"
#include "host/controller/settings_values.hpp"
#include "host/controller/telemetry_intake.hpp"
#include "host/controller/wire_program.hpp"
#include "host/transport/clock.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {

/// What an armed program will do, as the controller planned it.
using ProgramPlan = std::vector<wire::SegmentPlanned>;

class ControllerClient final : public Controller {
 public:
  using OpenLine = std::function<std::unique_ptr<ByteLine>()>;

  ControllerClient(Clock& clock, const RigConfig& rig, OpenLine open_line)
      : clock_(clock),
        rig_(rig),
        open_line_(std::move(open_line)),
        link_(clock, {[this](const wire::Received& message) { take(message); },
                      [this](std::string reason) {
                        disconnect();
                        requests_.forget();
                        telemetry_.take(LinkBroken{std::move(reason)});
                      },
                      [this] { ask_status_if_due(); }}),
        requests_(clock, link_, rig.controller.port) {}

  /// Opens the line, checks that both sides speak the same protocol, stops a motion that goes on (found_moving()), takes
  /// out a program that waits armed, reads the controller's settings, and sends geometry and limits if they agree with the rig file; if not, orders
  /// to move throw settings_problem(). A faulted controller takes none before clear_fault(). Throws
  /// HardwareError with the remedy in words, InputError if a number of the rig file is beyond what the protocol can
  /// carry; it is not connected then, and no heartbeat of this client prolongs a motion.
  void connect() {
    disconnect();
    if (!link_.open(open_line_())) {
      requests_.fail("does not answer",
                     "Check that it is powered and runs the firmware (diastole flash), and `baud`.");
    }
    try {
      greet();
      stop_what_moves();
      read_settings();
      configure_if_possible();
    } catch (...) {
      disconnect();
      throw;
    }
  }
  void disconnect() {
    link_.close();
    hello_.reset();
  }
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
  void write_settings(const wire::MachineSettings& settings) {
    requests_.demand(wire::WriteSettings{.settings = settings});
    configured_ = false;
    read_settings();
    if (!settings_problem_) configure();
  }
  /// The last events, oldest first, over resets.
  std::vector<wire::BlackBoxEntry> black_box() {
    std::vector<wire::BlackBoxEntry> entries;
    for (uint32_t from = 0;; from = entries.back().number + 1) {
      const auto report = requests_.ask<wire::BlackBoxReport>(wire::ReadBlackBox{.from = from},
                                                              "does not report its black box");
      if (report.entry.number < std::max(from, 1U)) return entries;
      entries.push_back(report.entry);
    }
  }

  /// One measurement over loop-back wires (self_test.hpp). Throws HardwareError if the controller may not now.
  wire::SelfTestReport self_test(wire::SelfTestItem item, uint16_t argument = 0) {
    return requests_.ask<wire::SelfTestReport>(wire::SelfTest{.item = item, .argument = argument},
                                               "does not report what it measured");
  }

  /// Loads and checks a whole program; afterwards the controller is armed, and will report positions at the
  /// sample rate, but no slower than 300 Hz and no faster than 1000 Hz. A program beyond a limit throws
  /// InputError naming the experiment's segment, the limit, what was asked and what is allowed; so does one
  /// whose reports are more than the line's baud rate carries.
  ProgramPlan load(const Experiment& experiment) {
    require_configuration();
    position_rate_Hz_ = reported_rate_Hz(experiment, rig_.controller);
    requests_.demand(wire::ClearProgram{});
    upload(experiment);
    for (size_t index = 0; index < experiment.segments.size(); ++index) {
      if (const auto refusal = requests_.refusal_of(segment_message(experiment, index)))
        refuse_program(experiment, index, *refusal);
    }
    plan_.clear();
    wire::Arm arm = arm_message(experiment, rig_);
    arm.position_period_ticks = static_cast<uint32_t>(hello_->tick_rate_Hz / position_rate_Hz_);
    if (const auto refusal = requests_.refusal_of(arm)) {
      if (refusal->refusal == wire::Refusal::limit_exceeded ||
          refusal->refusal == wire::Refusal::unknown_waveform)
        refuse_program(experiment, refusal->segment, *refusal);
      requests_.fail(std::string(wire::refusal_explanation(refusal->refusal)), remedy_for(refusal->refusal));
    }
    const uint64_t end_ns = clock_.now_ns() + plan_timeout_ns;
    while (plan_.size() < experiment.segments.size() && link_.has_line() && clock_.now_ns() < end_ns)
      link_.turn();
    return plan_;
  }
  /// Forgets the program; an armed controller is then homed.
  void unload() { requests_.demand(wire::ClearProgram{}); }
  void home() {
    require_configuration();
    requests_.demand(wire::Home{.lease_id = link_.lease_id()});
  }
  /// Moves by `distance_mL`, inflate positive. Throws InputError with the limit that it would exceed.
  void jog(double distance_mL, double rate_mL_s) {
    require_configuration();
    constexpr double most_mL = 50'000;
    if (!(std::abs(distance_mL) <= most_mL))
      throw InputError({"", "--mL", fmt::format("is {:g}", distance_mL),
                        "Give a distance within the pump's travel (`diastole settings` shows it)."});
    wire::Jog message;
    message.lease_id = link_.lease_id();
    message.distance_nL = std::llround(1e6 * distance_mL);
    message.flow_uL_per_s = whole({"", "--rate-mL-s", 1e3 * rate_mL_s, "uL/s", 1, 10'000'000});
    const auto refusal = requests_.refusal_of(message);
    if (!refusal) return;
    if (refusal->refusal == wire::Refusal::limit_exceeded) refuse_jog(*refusal);
    requests_.fail(fmt::format("the jog is refused: {}", wire::refusal_explanation(refusal->refusal)),
                   remedy_for(refusal->refusal));
  }
  /// Sends geometry and limits too if connect() could not.
  void clear_fault() {
    requests_.demand(wire::ClearFault{});
    if (configured_) return;
    (void)status();
    configure_if_possible();
  }
  wire::Status status() {
    return requests_.ask<wire::Status>(wire::StatusRequest{}, "does not report its status");
  }
  /// The last status, brought forward by the events since: state, fault, position, segment, cycle, triggers and
  /// R-waves are of now, or a batch of positions old. In a run service() asks for it twice a second: the rest is no
  /// older than that.
  [[nodiscard]] const wire::Status& last_known() const { return telemetry_.last_known(); }

  void service() override { link_.service(); }
  [[nodiscard]] uint64_t next_due_ns() const override { return link_.next_due_ns(); }
  std::vector<ControllerEvent> take_events() override { return telemetry_.take_events(); }
  void start() override { requests_.post(wire::Start{.lease_id = link_.lease_id()}); }
  void stop_at_cycle_end() override { requests_.post(wire::StopAtCycleEnd{}); }
  void stop_now() override { requests_.post(wire::StopNow{}); }
  void halt() override { requests_.post(wire::Halt{}); }
  ByteLine* line() override { return link_.line(); }

 private:
  static constexpr uint64_t ns_per_ms = 1'000'000;
  static constexpr uint64_t status_question_interval_ns = 500 * ns_per_ms;
  static constexpr uint64_t rest_timeout_ns = 5'000 * ns_per_ms;
  static constexpr uint64_t plan_timeout_ns = 1'000 * ns_per_ms;

  static bool moves(wire::State state) {
    return state == wire::State::running || state == wire::State::stopping || state == wire::State::homing ||
           state == wire::State::jogging;
  }

  void take(const wire::Received& received) {
    wire::visit_message(received.type, received.payload,
                        wire::overloaded{
                            [&](const wire::Hello& m) { requests_.take(m); },
                            [&](const wire::Ack& m) { requests_.take(m); },
                            [&](const wire::SettingsReport& m) { requests_.take(m); },
                            [&](const wire::BlackBoxReport& m) { requests_.take(m); },
                            [&](const wire::SelfTestReport& m) { requests_.take(m); },
                            [&](const wire::Nak& m) {
                              if (!requests_.take(m)) telemetry_.take(m);
                            },
                            [&](const wire::Status& m) {
                              telemetry_.take(m);
                              requests_.take(m);
                            },
                            [&](const wire::TimeSync& m) {
                              if (const auto reading = link_.take(m)) telemetry_.take(*reading);
                            },
                            [&](const wire::SegmentPlanned& m) { plan_.push_back(m); },
                            [&](const auto& m) {
                              if constexpr (std::is_constructible_v<ControllerEvent, decltype(m)>)
                                telemetry_.take(ControllerEvent(m));
                            },
                        });
  }
  void greet() {
    const auto hello = requests_.ask<wire::Hello>(
        wire::HelloRequest{.schema_hash = wire::kSchemaHash,
                           .version_major = own_version[0],
                           .version_minor = own_version[1],
                           .version_patch = own_version[2]},
        "does not introduce itself", "Flash it again (diastole flash), then restart the daemon.");
    const std::string& port = rig_.controller.port;
    if (hello.schema_hash == wire::kBootloaderSchema) {
      requests_.fail("waits in its bootloader and runs no firmware",
                     "Stop the daemon and flash one: diastole flash IMAGE --port " + port);
    }
    if (const auto mismatch = compare_versions(hello, own_version, wire::kSchemaHash, port))
      requests_.fail(mismatch->problem, mismatch->remedy);
    hello_ = hello;
    link_.greeted();
  }
  void read_settings() {
    settings_ = requests_.ask<wire::SettingsReport>(wire::ReadSettings{}, "does not report its settings");
    const bool written = settings_.records_written > 0;
    settings_problem_ = written ? disagreement(rig_, settings_.settings) : std::nullopt;
    microstep_pL_ = written ? settings_.microstep_pL
                            : whole({rig_.file, "rig, volume of one microstep", 1e9 * rig_.microstep_mL, "pL",
                                     1, 4'000'000'000});
  }
  void stop_what_moves() {
    found_moving_.reset();
    const wire::State found = status().state;
    if (found == wire::State::armed) unload();  // by a host that went away before it started
    if (!moves(found)) return;
    found_moving_ = found;
    stop_now();
    const uint64_t end_ns = clock_.now_ns() + rest_timeout_ns;
    while (moves(status().state)) {
      if (clock_.now_ns() > end_ns)
        requests_.fail("moves and does not obey a stop", "Press the emergency stop.");
      link_.turn();
    }
    link_.beat_at_once();  // none counted while the motion held another host's lease
  }
  void configure_if_possible() {
    configured_ = false;
    if (!settings_problem_ && last_known().state != wire::State::faulted) configure();
  }
  void configure() {
    requests_.demand(configuration(rig_, microstep_pL_));
    configured_ = true;
  }
  /// Precondition: the program is empty.
  void upload(const Experiment& experiment) {
    for (size_t number = 0; number < experiment.waveforms.size(); ++number) {
      const std::vector<int16_t>& rises = experiment.waveforms[number].even.rises;
      const auto put = [&](const auto& message) {
        const auto refusal = requests_.refusal_of(message);
        if (!refusal) return;
        const auto segment =
            std::ranges::find(experiment.segments, std::optional(number), &ExperimentSegment::upload);
        refuse_program(experiment, static_cast<size_t>(segment - experiment.segments.begin()), *refusal);
      };
      put(waveform_message(rises, number));
      std::ranges::for_each(waveform_batches(rises), put);
    }
  }
  /// Throws unless the controller has settings that agree with the rig file, and the file's limits.
  void require_configuration() const {
    if (settings_problem_) throw InputError(*settings_problem_);
    if (configured_) return;
    requests_.fail(fmt::format("has a fault latched: {}", wire::fault_explanation(last_known().fault)),
                   std::string(wire::fault_remedy(last_known().fault)));
  }
  /// While an answer is awaited there is somebody who waits for the line.
  void ask_status_if_due() {
    const wire::State state = last_known().state;
    const bool in_run = state == wire::State::running || state == wire::State::stopping;
    if (!in_run || requests_.awaiting() || clock_.now_ns() < next_status_question_ns_) return;
    next_status_question_ns_ = clock_.now_ns() + status_question_interval_ns;
    requests_.post(wire::StatusRequest{});
  }

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
