#include "host/controller/controller_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/controller/controller_words.hpp"
#include "host/controller/settings_values.hpp"
#include "host/controller/wire_program.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

constexpr uint64_t ns_per_ms = 1'000'000;
constexpr uint64_t status_question_interval_ns = 500 * ns_per_ms;
constexpr uint64_t rest_patience_ns = 5'000 * ns_per_ms;
constexpr uint64_t plan_patience_ns = 1'000 * ns_per_ms;

bool moves(wire::State state) {
  return state == wire::State::running || state == wire::State::stopping || state == wire::State::homing ||
         state == wire::State::jogging;
}

}  // namespace

ControllerClient::ControllerClient(Clock& clock, const RigConfig& rig, OpenLine open_line)
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

void ControllerClient::connect() {
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

void ControllerClient::disconnect() {
  link_.close();
  hello_.reset();
}

void ControllerClient::greet() {
  const auto hello = requests_.ask<wire::Hello>(wire::HelloRequest{.schema_hash = wire::kSchemaHash,
                                                                   .version_major = own_version[0],
                                                                   .version_minor = own_version[1],
                                                                   .version_patch = own_version[2]},
                                                "does not introduce itself",
                                                "Flash it again (diastole flash), then restart the daemon.");
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

void ControllerClient::stop_what_moves() {
  found_moving_.reset();
  const wire::State found = status().state;
  if (!moves(found)) return;
  found_moving_ = found;
  stop_now();
  const uint64_t end_ns = clock_.now_ns() + rest_patience_ns;
  while (moves(status().state)) {
    if (clock_.now_ns() > end_ns)
      requests_.fail("moves and does not obey a stop", "Press the emergency stop.");
    link_.turn();
  }
  link_.beat_at_once();  // none counted while the motion held another host's lease
}

void ControllerClient::read_settings() {
  settings_ = requests_.ask<wire::SettingsReport>(wire::ReadSettings{}, "does not report its settings");
  const bool written = settings_.records_written > 0;
  settings_problem_ = written ? disagreement(rig_, settings_.settings) : std::nullopt;
  microstep_pL_ = written ? settings_.microstep_pL
                          : whole({rig_.file, "rig, volume of one microstep", 1e9 * rig_.microstep_mL, "pL",
                                   1, 4'000'000'000});
}

void ControllerClient::configure_if_possible() {
  configured_ = false;
  if (!settings_problem_ && last_known().state != wire::State::faulted) configure();
}

void ControllerClient::configure() {
  requests_.demand(configuration(rig_, microstep_pL_));
  configured_ = true;
}

void ControllerClient::require_configuration() const {
  if (settings_problem_) throw InputError(*settings_problem_);
  if (configured_) return;
  requests_.fail(fmt::format("has a fault latched: {}", wire::fault_explanation(last_known().fault)),
                 std::string(wire::fault_remedy(last_known().fault)));
}

void ControllerClient::write_settings(const wire::MachineSettings& settings) {
  requests_.demand(wire::WriteSettings{.settings = settings});
  configured_ = false;
  read_settings();
  if (!settings_problem_) configure();
}

std::vector<wire::BlackBoxEntry> ControllerClient::black_box() {
  std::vector<wire::BlackBoxEntry> entries;
  for (uint32_t from = 0;; from = entries.back().number + 1) {
    const auto report = requests_.ask<wire::BlackBoxReport>(wire::ReadBlackBox{.from = from},
                                                            "does not report its black box");
    if (report.entry.number < std::max(from, 1U)) return entries;
    entries.push_back(report.entry);
  }
}

/// Precondition: the program is empty.
void ControllerClient::upload(const Experiment& experiment) {
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
    std::ranges::for_each(waveform_lots(rises), put);
  }
}

ProgramPlan ControllerClient::load(const Experiment& experiment) {
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
  const uint64_t end_ns = clock_.now_ns() + plan_patience_ns;
  while (plan_.size() < experiment.segments.size() && link_.has_line() && clock_.now_ns() < end_ns)
    link_.turn();
  return plan_;
}

void ControllerClient::unload() { requests_.demand(wire::ClearProgram{}); }

void ControllerClient::home() {
  require_configuration();
  requests_.demand(wire::Home{.lease_id = link_.lease_id()});
}

void ControllerClient::jog(double distance_mL, double rate_mL_s) {
  require_configuration();
  constexpr double most_mL = 50'000;
  if (!(std::abs(distance_mL) <= most_mL))
    throw InputError({"", "--mL", fmt::format("is {:g}", distance_mL),
                      "Give a distance within the pump's travel (`diastole settings` tells it)."});
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

void ControllerClient::clear_fault() {
  requests_.demand(wire::ClearFault{});
  if (configured_) return;
  (void)status();
  configure_if_possible();
}

wire::Status ControllerClient::status() {
  return requests_.ask<wire::Status>(wire::StatusRequest{}, "does not report its status");
}

void ControllerClient::start() { requests_.post(wire::Start{.lease_id = link_.lease_id()}); }
void ControllerClient::stop_at_cycle_end() { requests_.post(wire::StopAtCycleEnd{}); }
void ControllerClient::stop_now() { requests_.post(wire::StopNow{}); }
void ControllerClient::halt() { requests_.post(wire::Halt{}); }

void ControllerClient::take(const wire::Received& received) {
  wire::visit_message(received.type, received.payload,
                      wire::overloaded{
                          [&](const wire::Hello& m) { requests_.take(m); },
                          [&](const wire::Ack& m) { requests_.take(m); },
                          [&](const wire::SettingsReport& m) { requests_.take(m); },
                          [&](const wire::BlackBoxReport& m) { requests_.take(m); },
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

/// While an answer is awaited there is somebody who waits for the line.
void ControllerClient::ask_status_if_due() {
  const wire::State state = last_known().state;
  const bool in_run = state == wire::State::running || state == wire::State::stopping;
  if (!in_run || requests_.awaiting() || clock_.now_ns() < next_status_question_ns_) return;
  next_status_question_ns_ = clock_.now_ns() + status_question_interval_ns;
  requests_.post(wire::StatusRequest{});
}

}  // namespace diastole
