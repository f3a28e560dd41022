#include "host/controller/controller_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "host/controller/settings_values.hpp"
#include "host/controller/version_match.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/crc32.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

constexpr uint64_t ns_per_ms = 1'000'000;
constexpr uint64_t ns_per_us = 1'000;
constexpr uint64_t heartbeat_interval_ns = 50 * ns_per_ms;
constexpr uint64_t time_question_interval_ns = 250 * ns_per_ms;
constexpr uint64_t status_question_interval_ns = 500 * ns_per_ms;
constexpr uint64_t rest_patience_ns = 5'000 * ns_per_ms;
constexpr uint64_t time_answer_patience_ns = 20 * ns_per_ms;
constexpr uint64_t fine_step_ns = 200 * ns_per_us;  // while an answer is awaited
constexpr uint64_t answer_patience_ns = 1'000 * ns_per_ms;
constexpr uint64_t open_patience_ns = 1'500 * ns_per_ms;
constexpr uint64_t silence_patience_ns = 1'000 * ns_per_ms;

/// A quantity of a file on its way into a message: `value` in the wire's unit, and what the wire can carry.
struct Quantity {
  const std::string& file;
  std::string place;
  double value;
  const char* unit;
  uint32_t least = 0;
  uint32_t most = UINT32_MAX;
};

/// The nearest whole number. Throws InputError if it lies outside the range.
uint32_t whole(const Quantity& quantity) {
  const double nearest = std::round(quantity.value);
  if (nearest >= quantity.least && nearest <= quantity.most) return static_cast<uint32_t>(nearest);
  throw InputError({quantity.file, quantity.place,
                    fmt::format("comes to {:g} {}, and the controller takes {} to {} {}", quantity.value,
                                quantity.unit, quantity.least, quantity.most, quantity.unit),
                    "Change it so that it lies in this range."});
}

/// Bytes per second on the line, with everything that comes beside the positions.
double line_load_B_s(double position_rate_Hz, const Experiment& experiment) {
  constexpr double frame_B = 12;  // header, CRC, COBS
  constexpr double batch_head_B = 17;
  constexpr double positions_a_batch = 30;          // at least, while a run is on
  constexpr double trigger_B = 2 * (frame_B + 16);  // a cycle may also begin a segment
  constexpr double background_B_s = 700;            // time answers, acknowledgements, states, status
  double shortest_period_s = std::numeric_limits<double>::infinity();
  for (const ExperimentSegment& segment : experiment.segments)
    shortest_period_s = std::min(shortest_period_s, segment.period_s);
  return position_rate_Hz * (sizeof(int32_t) + (frame_B + batch_head_B) / positions_a_batch) +
         trigger_B / shortest_period_s + background_B_s;
}

/// Positions follow the samples, between the 300 Hz that a run file promises and what any use of them needs.
double reported_rate_Hz(const Experiment& experiment, const ControllerConfig& controller) {
  constexpr double least_Hz = 300;
  constexpr double most_Hz = 1000;
  constexpr double bits_a_byte = 10;
  constexpr double usable = 0.8;  // the rest is for repetitions
  const double rate_Hz = std::clamp(experiment.sample_rate_Hz, least_Hz, most_Hz);
  const double load_baud = bits_a_byte / usable * line_load_B_s(rate_Hz, experiment);
  if (load_baud <= controller.baud) return rate_Hz;
  throw InputError(
      {experiment.file, "sample_rate_Hz",
       fmt::format("with {:g} positions/s and these periods the line to the controller needs {:.0f} "
                   "baud, and it has {}",
                   rate_Hz, load_baud, controller.baud),
       fmt::format("Raise baud in the rig file{}, or lengthen the shortest period_s.",
                   rate_Hz > least_Hz ? ", lower sample_rate_Hz (to 300 at the least)" : "")});
}

struct LimitInWords {
  double scale;  // wire's unit to the user's
  const char* unit;
  const char* remedy;
};

LimitInWords words_for(wire::Limit limit) {
  switch (limit) {
    case wire::Limit::travel:
      return {1e-3, "mL", "Reduce stroke_mL or offset_mL."};
    case wire::Limit::flow:
      return {1e-3, "mL/s", "Reduce stroke_mL or lengthen period_s."};
    case wire::Limit::acceleration:
      return {1e-3, "mL/s2", "Reduce stroke_mL or lengthen period_s; a parabolic waveform needs least."};
    case wire::Limit::step_rate:
      return {1, "microsteps/s", "Reduce stroke_mL, lengthen period_s, or use fewer microsteps."};
    case wire::Limit::pressure:
      return {1e-3, "kPa",
              "Reduce stroke_mL or lengthen period_s: the fluid in the hose is too hard to move."};
    case wire::Limit::stroke_at_least:
      return {1e-6, "mL", "Enlarge stroke_mL to at least one microstep."};
    case wire::Limit::stopping_time:
      return {1e-6, "s", "Reduce stroke_mL or lengthen period_s, or raise lease_ms in the rig file."};
    case wire::Limit::ttl_width:
      return {1e-3, "ms", "Reduce ttl_width_ms in the rig file or lengthen period_s."};
    case wire::Limit::r_wave_spacing:
      return {1e-6, "s", "Lengthen period_s or raise gate_every."};
    case wire::Limit::microstep:
      return {1, "pL", "Make bore, screw and steps in the rig file agree with the controller's settings."};
    case wire::Limit::home:
      return {1e-3, "mL", "Withdraw less: the home position ends the way."};
    case wire::Limit::take_up:
      return {
          1e-3, "ms",
          "Reduce stroke_mL or lengthen period_s: at each reversal the motor needs this time to take up the "
          "backlash (diastole settings)."};
    case wire::Limit::trigger_delay:
      return {1e-3, "ms", "Reduce trigger_delay_ms: the TTL and the R-wave of 30 ms end within the period."};
    case wire::Limit::none:
      break;
  }
  return {1, "", "Change the program."};
}

[[noreturn]] void refuse_program(const Experiment& experiment, const wire::Nak& nak) {
  const std::string place = fmt::format("segment[{}]", nak.segment);
  if (nak.refusal == wire::Refusal::limit_exceeded) {
    const LimitInWords words = words_for(nak.limit);
    throw InputError({experiment.file, place,
                      fmt::format("the controller refuses it: limit {}, asked {:g} {}, allowed {:g} {}",
                                  wire::limit_name(nak.limit), words.scale * static_cast<double>(nak.asked),
                                  words.unit, words.scale * static_cast<double>(nak.allowed), words.unit),
                      words.remedy});
  }
  if (nak.refusal == wire::Refusal::unknown_waveform) {
    throw InputError({experiment.file, place, "this firmware has no such waveform",
                      "Use parabolic or sinusoidal, which every firmware has, or update the firmware."});
  }
  if (nak.refusal == wire::Refusal::program_full) {
    throw InputError({experiment.file, place, "is more than the controller's program holds",
                      "Split the experiment into several runs."});
  }
  if (nak.refusal == wire::Refusal::waveform_unfit) {
    throw InputError(
        {experiment.file, place + ".points",
         "the controller refuses its waveform: it is steeper than 4294 strokes a period (squared)",
         "Smooth its points, or put them further apart."});
  }
  throw InputError({experiment.file, place,
                    fmt::format("the controller refuses it: {}", wire::refusal_explanation(nak.refusal)),
                    ""});
}

[[noreturn]] void refuse_jog(const wire::Nak& nak) {
  const auto asked = static_cast<double>(nak.asked), allowed = static_cast<double>(nak.allowed);
  switch (nak.limit) {
    case wire::Limit::flow:
      throw InputError({"", "--rate-mL-s",
                        fmt::format("is {:g}, and {:g} mL/s are allowed here", 1e-3 * asked, 1e-3 * allowed),
                        "Go slower; unhomed, the pump goes no faster than homing_flow_mL_s."});
    case wire::Limit::travel:
      throw InputError(
          {"", "--mL",
           fmt::format("would reach {:g} mL, and the travel is {:g} mL", 1e-3 * asked, 1e-3 * allowed),
           "Go less far."});
    case wire::Limit::home:
      throw InputError({"", "--mL",
                        fmt::format("would withdraw {:g} mL, and the piston stands at {:g} mL", 1e-3 * asked,
                                    1e-3 * allowed),
                        "Go less far; `diastole home` finds position 0."});
    default:
      throw InputError({"", "--mL", fmt::format("is {:g}, less than one microstep", 1e-6 * asked),
                        fmt::format("A microstep is {:g} mL.", 1e-6 * allowed)});
  }
}

bool moves(wire::State state) {
  return state == wire::State::running || state == wire::State::stopping || state == wire::State::homing ||
         state == wire::State::jogging;
}

std::string remedy_for(wire::Refusal refusal) {
  switch (refusal) {
    case wire::Refusal::wrong_state:
      return "A latched fault needs `diastole clear-fault` first, an unhomed pump `diastole home`; `diastole "
             "status` tells the state.";
    case wire::Refusal::estop_pressed:
      return "Make the rig safe and release the emergency stop.";
    case wire::Refusal::malformed:
      return "A number in the rig or experiment file is beyond what this firmware takes; restart the daemon "
             "after "
             "a change of the rig file.";
    case wire::Refusal::home_switch_closed:
      return "The piston stands on the home switch: jog the other way (a positive distance), or `diastole "
             "home`.";
    case wire::Refusal::settings_mismatch:
      return "Compare the rig file with `diastole settings`.";
    case wire::Refusal::flash_failed:
      return "Try again; if it persists the chip's flash is worn out: replace the board.";
    case wire::Refusal::limit_switch_closed:
      return "Jog away from the far limit switch (a negative distance), then `diastole home`.";
    default:
      return "`diastole status` tells more; restart the daemon if it persists.";
  }
}

}  // namespace

ControllerClient::ControllerClient(Clock& clock, const RigConfig& rig, OpenLine open_line)
    : clock_(clock), rig_(rig), open_line_(std::move(open_line)) {
  std::random_device random;
  session_ = static_cast<uint16_t>(random());
  lease_id_ = random() | 1U;
}

void ControllerClient::fail(std::string problem, std::string remedy) const {
  throw HardwareError("controller at " + rig_.controller.port, std::move(problem), std::move(remedy));
}

void ControllerClient::connect() {
  disconnect();
  line_ = open_line_();
  clock_.line_opened(*line_);
  link_.open(++session_, clock_.now_ns() / ns_per_us);
  const uint64_t end_ns = clock_.now_ns() + open_patience_ns;
  while (link_.state() != wire::ReliableLink::State::open && line_ != nullptr && clock_.now_ns() < end_ns)
    turn();
  if (link_.state() != wire::ReliableLink::State::open) {
    disconnect();
    fail("does not answer", "Check that it is powered and runs the firmware (diastole flash), and `baud`.");
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

void ControllerClient::stop_what_moves() {
  found_moving_.reset();
  const wire::State found = status().state;
  if (!moves(found)) return;
  found_moving_ = found;
  stop_now();
  const uint64_t end_ns = clock_.now_ns() + rest_patience_ns;
  while (moves(status().state)) {
    if (clock_.now_ns() > end_ns) fail("moves and does not obey a stop", "Press the emergency stop.");
    turn();
  }
  next_heartbeat_ns_ = clock_.now_ns();  // none counted while the motion held another host's lease
}

void ControllerClient::configure_if_possible() {
  configured_ = false;
  if (!settings_problem_ && last_known_.state != wire::State::faulted) configure();
}

void ControllerClient::disconnect() {
  link_.close();
  line_.reset();
  hello_.reset();
  time_asked_ns_ = 0;
}

void ControllerClient::greet() {
  const Answer answer = request(wire::HelloRequest{.schema_hash = wire::kSchemaHash,
                                                   .version_major = own_version[0],
                                                   .version_minor = own_version[1],
                                                   .version_patch = own_version[2]});
  if (!answer.hello) {
    disconnect();
    fail("does not introduce itself", "Flash it again (diastole flash), then restart the daemon.");
  }
  if (answer.hello->schema_hash == wire::kBootloaderSchema) {
    disconnect();
    fail("waits in its bootloader and runs no firmware",
         "Stop the daemon and flash one: diastole flash IMAGE --port " + rig_.controller.port);
  }
  if (const auto mismatch =
          compare_versions(*answer.hello, own_version, wire::kSchemaHash, rig_.controller.port)) {
    disconnect();
    fail(mismatch->problem, mismatch->remedy);
  }
  hello_ = answer.hello;
  next_time_question_ns_ = clock_.now_ns();
  next_heartbeat_ns_ = clock_.now_ns();  // the first order may follow at once
}

void ControllerClient::read_settings() {
  const Answer answer = request(wire::ReadSettings{});
  if (!answer.settings) fail("does not tell its settings", "Restart the daemon if it persists.");
  settings_ = *answer.settings;
  const bool written = settings_.records_written > 0;
  settings_problem_ = written ? disagreement(rig_, settings_.settings) : std::nullopt;
  microstep_pL_ = written ? settings_.microstep_pL
                          : whole({rig_.file, "rig, volume of one microstep", 1e9 * rig_.microstep_mL, "pL",
                                   1, 4'000'000'000});
}

void ControllerClient::require_configuration() const {
  if (settings_problem_) throw InputError(*settings_problem_);
  if (configured_) return;
  fail(fmt::format("has a fault latched: {}", wire::fault_explanation(last_known_.fault)),
       std::string(wire::fault_remedy(last_known_.fault)));
}

void ControllerClient::write_settings(const wire::MachineSettings& settings) {
  demand(wire::WriteSettings{.settings = settings});
  configured_ = false;
  read_settings();
  if (!settings_problem_) configure();
}

std::vector<wire::BlackBoxEntry> ControllerClient::black_box() {
  std::vector<wire::BlackBoxEntry> entries;
  for (uint32_t from = 0;; from = entries.back().number + 1) {
    const Answer answer = request(wire::ReadBlackBox{.from = from});
    if (!answer.black_box) fail("does not tell its black box", "Restart the daemon if it persists.");
    if (answer.black_box->entry.number < std::max(from, 1U)) return entries;
    entries.push_back(answer.black_box->entry);
  }
}

void ControllerClient::configure() {
  const MotionLimits& limits = rig_.controller.limits;
  const auto limit = [&](const char* key, double value, const char* unit, uint32_t most) {
    return whole({rig_.file, std::string("controller.limits.") + key, value, unit, 1, most});
  };
  wire::Configure message;
  message.microstep_pL = microstep_pL_;
  message.travel_uL = limit("travel_mL", 1e3 * limits.travel_mL, "uL", 50'000'000);
  message.flow_uL_per_s = limit("flow_mL_s", 1e3 * limits.flow_mL_s, "uL/s", 10'000'000);
  message.acceleration_uL_per_s2 =
      limit("acceleration_mL_s2", 1e3 * limits.acceleration_mL_s2, "uL/s2", 1'000'000'000);
  message.step_rate_Hz = limit("step_rate_Hz", limits.step_rate_Hz, "microsteps/s", 400'000);
  message.pressure_Pa = limit("pressure_kPa", 1e3 * limits.pressure_kPa, "Pa", 10'000'000);
  message.inertance_kg_per_m4 =
      whole({rig_.file, "rig, inertance of the hose", rig_.hose_inertance_kg_m4, "kg/m4", 1});
  message.lease_us = static_cast<uint32_t>(rig_.controller.lease_ms * 1000);
  message.homing_flow_uL_per_s = limit("homing_flow_mL_s", 1e3 * limits.homing_flow_mL_s, "uL/s", 10'000'000);
  demand(message);
  configured_ = true;
}

/// Precondition: the program is empty.
void ControllerClient::upload(const Experiment& experiment) {
  for (size_t number = 0; number < experiment.waveforms.size(); ++number) {
    const std::vector<int16_t>& rises = experiment.waveforms[number].even.rises;
    const auto put = [&](const auto& message) {
      Answer answer = request(message);
      if (!answer.nak) return;
      const auto segment =
          std::ranges::find(experiment.segments, std::optional(number), &ExperimentSegment::upload);
      answer.nak->segment = static_cast<uint16_t>(segment - experiment.segments.begin());
      refuse_program(experiment, *answer.nak);
    };
    wire::Crc32 crc;
    for (const int16_t rise : rises) {
      crc.add(static_cast<uint8_t>(rise & 0xFF));
      crc.add(static_cast<uint8_t>((rise >> 8) & 0xFF));
    }
    put(wire::UploadWaveform{0, static_cast<uint8_t>(number), static_cast<uint16_t>(rises.size()),
                             crc.value()});
    for (size_t first = 0; first < rises.size(); first += wire::WaveformPoints::kMaxCount) {
      wire::WaveformPoints lot;
      lot.first = static_cast<uint16_t>(first);
      lot.count = static_cast<uint8_t>(std::min(wire::WaveformPoints::kMaxCount, rises.size() - first));
      std::copy_n(rises.begin() + static_cast<std::ptrdiff_t>(first), lot.count, lot.rise.begin());
      put(lot);
    }
  }
}

ProgramPlan ControllerClient::load(const Experiment& experiment) {
  require_configuration();
  position_rate_Hz_ = reported_rate_Hz(experiment, rig_.controller);
  demand(wire::ClearProgram{});
  upload(experiment);
  for (const ExperimentSegment& segment : experiment.segments) {
    const auto index = static_cast<uint16_t>(&segment - experiment.segments.data());
    const auto quantity = [&](const char* key, double value, const char* unit) {
      return whole({experiment.file, fmt::format("segment[{}].{}", index, key), value, unit});
    };
    wire::AddSegment message;
    message.waveform = segment.waveform;
    message.cycles = static_cast<uint32_t>(segment.cycles);
    message.stroke_nL = quantity("stroke_mL", 1e6 * segment.stroke_mL, "nL");
    message.offset_nL = quantity("offset_mL", 1e6 * segment.offset_mL, "nL");
    message.period_us = quantity("period_s", 1e6 * segment.period_s, "us");
    message.upload = static_cast<uint8_t>(segment.upload.value_or(0));
    Answer answer = request(message);
    if (answer.nak) {
      answer.nak->segment = index;
      refuse_program(experiment, *answer.nak);
    }
  }
  plan_.clear();
  wire::Arm arm;
  arm.gate_every = static_cast<uint16_t>(experiment.gate_every);
  arm.rest_us = whole({experiment.file, "rest_s", 1e6 * experiment.rest_s, "us"});
  arm.ttl_width_us =
      whole({rig_.file, "controller.ttl_width_ms", 1e3 * rig_.controller.ttl_width_ms, "us", 1});
  arm.trigger_delay_us =
      whole({experiment.file, "trigger_delay_ms", 1e3 * experiment.trigger_delay_ms, "us", 0, 10'000'000});
  arm.position_period_ticks = static_cast<uint32_t>(hello_->tick_rate_Hz / position_rate_Hz_);
  const Answer answer = request(arm);
  if (answer.nak && (answer.nak->refusal == wire::Refusal::limit_exceeded ||
                     answer.nak->refusal == wire::Refusal::unknown_waveform)) {
    refuse_program(experiment, *answer.nak);
  }
  if (answer.nak) {
    fail(std::string(wire::refusal_explanation(answer.nak->refusal)), remedy_for(answer.nak->refusal));
  }
  const uint64_t end_ns = clock_.now_ns() + answer_patience_ns;
  while (plan_.size() < experiment.segments.size() && line_ != nullptr && clock_.now_ns() < end_ns)
    turn();
  return plan_;
}

void ControllerClient::unload() { demand(wire::ClearProgram{}); }

void ControllerClient::home() {
  require_configuration();
  demand(wire::Home{.lease_id = lease_id_});
}

void ControllerClient::jog(double distance_mL, double rate_mL_s) {
  require_configuration();
  constexpr double most_mL = 50'000;
  if (!(std::abs(distance_mL) <= most_mL))
    throw InputError({"", "--mL", fmt::format("is {:g}", distance_mL),
                      "Give a distance within the pump's travel (`diastole settings` tells it)."});
  wire::Jog message;
  message.lease_id = lease_id_;
  message.distance_nL = std::llround(1e6 * distance_mL);
  message.flow_uL_per_s = whole({"", "--rate-mL-s", 1e3 * rate_mL_s, "uL/s", 1, 10'000'000});
  const Answer answer = request(message);
  if (!answer.nak) return;
  if (answer.nak->refusal == wire::Refusal::limit_exceeded) refuse_jog(*answer.nak);
  fail(fmt::format("the jog is refused: {}", wire::refusal_explanation(answer.nak->refusal)),
       remedy_for(answer.nak->refusal));
}

void ControllerClient::halt() { post(wire::Halt{}); }

void ControllerClient::clear_fault() {
  demand(wire::ClearFault{});
  if (configured_) return;
  (void)status();
  configure_if_possible();
}

wire::Status ControllerClient::status() {
  const Answer answer = request(wire::StatusRequest{});
  if (!answer.status) fail("does not tell its status", "Restart the daemon if it persists.");
  return *answer.status;
}

void ControllerClient::start() { post(wire::Start{.lease_id = lease_id_}); }
void ControllerClient::stop_at_cycle_end() { post(wire::StopAtCycleEnd{}); }
void ControllerClient::stop_now() { post(wire::StopNow{}); }

std::vector<ControllerEvent> ControllerClient::take_events() { return std::exchange(events_, {}); }

uint64_t ControllerClient::next_due_ns() const {
  if (!connected()) return UINT64_MAX;
  const uint64_t due_ns = std::min(next_heartbeat_ns_, next_time_question_ns_);
  return time_asked_ns_ != 0 ? std::min(due_ns, clock_.now_ns() + fine_step_ns) : due_ns;
}

void ControllerClient::service() {
  if (line_ == nullptr) return;
  receive();
  if (link_.state() == wire::ReliableLink::State::lost) return broke("the controller was reset");
  if (line_->lost()) return broke("the serial line is gone");
  keep_alive();
  transmit();
}

void ControllerClient::turn() {
  service();
  if (line_ == nullptr) return;
  clock_.sleep_until_ns(clock_.now_ns() + fine_step_ns, line_.get());
  service();
}

void ControllerClient::receive() {
  std::array<uint8_t, 512> block{};
  const uint64_t now_us = clock_.now_ns() / ns_per_us;
  for (size_t count = line_->read(block); count > 0; count = line_->read(block)) {
    for (size_t i = 0; i < count; ++i) {
      const auto message = link_.receive(block[i], now_us);
      if (!message) continue;
      wire::visit_message(message->type, message->payload,
                          wire::overloaded{
                              [&](const wire::Hello& m) { take_answer(m); },
                              [&](const wire::Ack& m) { take_answer(m); },
                              [&](const wire::Nak& m) { take_answer(m); },
                              [&](const wire::Status& m) { take_answer(m); },
                              [&](const wire::SettingsReport& m) { take_answer(m); },
                              [&](const wire::BlackBoxReport& m) { take_answer(m); },
                              [&](const wire::TimeSync& m) { take(m); },
                              [&](const wire::SegmentPlanned& m) { plan_.push_back(m); },
                              [&](const auto& m) {
                                if constexpr (std::is_constructible_v<ControllerEvent, decltype(m)>) {
                                  bring_forward(events_.emplace_back(m));
                                }
                              },
                          });
    }
  }
}

template <class Message>
void ControllerClient::take_answer(const Message& message) {
  bool mine = awaited_ == message.request_id;
  if constexpr (std::is_same_v<Message, wire::Nak>) {
    // A request that cannot be decoded is refused without its number.
    mine = mine || (awaited_ && message.refusal == wire::Refusal::malformed && message.request_id == 0 &&
                    message.request_type == awaited_type_);
    if (!mine) events_.emplace_back(message);
  }
  if constexpr (std::is_same_v<Message, wire::Status>) last_known_ = message;
  if (!mine) return;
  awaited_.reset();
  if constexpr (std::is_same_v<Message, wire::Hello>) answer_.hello = message;
  if constexpr (std::is_same_v<Message, wire::Ack>) answer_.ack = message;
  if constexpr (std::is_same_v<Message, wire::Nak>) answer_.nak = message;
  if constexpr (std::is_same_v<Message, wire::SettingsReport>) answer_.settings = message;
  if constexpr (std::is_same_v<Message, wire::BlackBoxReport>) answer_.black_box = message;
  if constexpr (std::is_same_v<Message, wire::Status>) answer_.status = message;
}

void ControllerClient::bring_forward(const ControllerEvent& event) {
  if (const auto* change = std::get_if<wire::StateChanged>(&event)) last_known_.state = change->to;
  if (const auto* raised = std::get_if<wire::FaultRaised>(&event)) last_known_.fault = raised->fault;
  if (const auto* started = std::get_if<wire::SegmentStarted>(&event)) last_known_.segment = started->segment;
  // A status is ahead of the events that waited for the line when it was asked for.
  const auto is_news = [&](uint64_t tick) { return tick > last_known_.tick; };
  if (const auto* trigger = std::get_if<wire::Trigger>(&event);
      trigger != nullptr && is_news(trigger->tick)) {
    ++last_known_.triggers;
    last_known_.r_waves += trigger->r_wave;
    last_known_.cycle = trigger->cycle + 1;
  }
  if (const auto* batch = std::get_if<wire::PositionBatch>(&event);
      batch != nullptr && batch->count > 0 &&
      is_news(batch->first_tick + uint64_t{batch->period_ticks} * (batch->count - 1U)))
    last_known_.position_microsteps = batch->position_microsteps[batch->count - 1U];
  if (const auto* ended = std::get_if<wire::RunEnded>(&event))
    last_known_.position_microsteps = ended->position_microsteps;
}

void ControllerClient::transmit() {
  const uint64_t now_us = clock_.now_ns() / ns_per_us;
  for (auto bytes = link_.transmit(now_us); !bytes.empty(); bytes = link_.transmit(now_us))
    line_->write(bytes);
}

void ControllerClient::keep_alive() {
  const uint64_t now_ns = clock_.now_ns();
  if (!hello_) return;
  const uint64_t heard_ns = link_.last_heard_us() * ns_per_us;
  if (now_ns > heard_ns + silence_patience_ns) return broke("the controller has fallen silent");
  if (now_ns >= next_heartbeat_ns_) {
    std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
    (void)link_.send(wire::Heartbeat::kType, wire::encode(wire::Heartbeat{.lease_id = lease_id_}, memory));
    next_heartbeat_ns_ = now_ns + heartbeat_interval_ns;
  }
  if (time_asked_ns_ != 0 && now_ns > time_asked_ns_ + time_answer_patience_ns) time_asked_ns_ = 0;
  if (now_ns >= next_time_question_ns_) ask_time();
  ask_status_if_due();
}

/// While an answer is awaited there is somebody who waits for the line.
void ControllerClient::ask_status_if_due() {
  const bool in_run = last_known_.state == wire::State::running || last_known_.state == wire::State::stopping;
  if (!in_run || awaited_ || clock_.now_ns() < next_status_question_ns_) return;
  next_status_question_ns_ = clock_.now_ns() + status_question_interval_ns;
  post(wire::StatusRequest{});
}

void ControllerClient::ask_time() {
  std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
  time_asked_ns_ = clock_.now_ns();
  next_time_question_ns_ = time_asked_ns_ + time_question_interval_ns;
  (void)link_.send(wire::TimeSyncRequest::kType,
                   wire::encode(wire::TimeSyncRequest{.token = ++time_token_}, memory));
}

void ControllerClient::take(const wire::TimeSync& sync) {
  if (sync.token != time_token_ || time_asked_ns_ == 0) return;
  const uint64_t received_ns = clock_.now_ns();
  events_.emplace_back(ClockReading{time_asked_ns_ + (received_ns - time_asked_ns_) / 2,
                                    sync.received_tick + (sync.replied_tick - sync.received_tick) / 2,
                                    (received_ns - time_asked_ns_) / 2});
  time_asked_ns_ = 0;
}

void ControllerClient::broke(std::string reason) {
  disconnect();
  awaited_.reset();
  events_.emplace_back(LinkBroken{std::move(reason)});
}

template <class Message>
uint16_t ControllerClient::post(Message message) {
  if (line_ == nullptr) return 0;
  std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
  message.request_id = next_request_id_++;
  (void)link_.send(Message::kType, wire::encode(message, memory));
  transmit();
  return message.request_id;
}

template <class Message>
ControllerClient::Answer ControllerClient::request(Message message) {
  if (line_ == nullptr) fail("is not connected", "Check cable and power; the daemon reconnects by itself.");
  answer_ = {};
  awaited_type_ = static_cast<uint8_t>(Message::kType);
  awaited_ = post(message);
  const uint64_t end_ns = clock_.now_ns() + answer_patience_ns;
  while (awaited_ && line_ != nullptr && clock_.now_ns() < end_ns)
    turn();
  if (line_ == nullptr) fail("the line broke", "Check the cable; the daemon reconnects by itself.");
  if (awaited_) {
    awaited_.reset();
    fail("did not answer in time", "Check the cable and the baud rate.");
  }
  return answer_;
}

template <class Message>
void ControllerClient::demand(Message message) {
  const Answer answer = request(message);
  if (answer.nak) {
    const std::string limit =
        answer.nak->refusal == wire::Refusal::limit_exceeded
            ? fmt::format(" (limit {}, asked {}, allowed {})", wire::limit_name(answer.nak->limit),
                          answer.nak->asked, answer.nak->allowed)
            : "";
    fail(fmt::format("refused: {}{}", wire::refusal_explanation(answer.nak->refusal), limit),
         remedy_for(answer.nak->refusal));
  }
}

}  // namespace diastole
