#pragma once
// Messages → actions → answers. Every request is answered once, with its request_id: Ack, Nak, Hello, Status,
// or what its header says.

#include <array>

#include "firmware/core/image_trial.hpp"
#include "firmware/core/motion.hpp"
#include "firmware/core/outbox.hpp"
#include "firmware/core/settings_store.hpp"
#include "firmware/core/version.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::firmware {

template <Board B>
class Dispatch {
 public:
  using Store = SettingsStore<typename B::SettingsFlash>;

  Dispatch(B& board, Motion<B>& motion, Store& store, BlackBox& black_box, ImageTrial<B>& trial,
           Outbox& outbox, wire::ReliableLink& link)
      : board_(board),
        motion_(motion),
        store_(store),
        black_box_(black_box),
        trial_(trial),
        outbox_(outbox),
        link_(link) {}

  void receive(const wire::Received& received) {
    if (link_.generation() != generation_) {
      generation_ = link_.generation();
      schema_agreed_ = false;
    }
    wire::visit_request(received.type, received.payload,
                        [this](const auto& message) { this->handle_or_refuse(message); });
  }

 private:
  /// Before the schema hashes are known to agree, only HelloRequest and what belongs to an update counts.
  template <class Message>
  void handle_or_refuse(const Message& message) {
    if constexpr (std::is_same_v<Message, wire::HelloRequest>) {
      handle(message);
    } else if constexpr (std::is_same_v<Message, wire::Undecodable>) {
      if (!message.known && wire::is_update(static_cast<wire::MessageType>(message.type)))
        answer(wire::UpdateAnswer{0, message.type, wire::UpdateOutcome::not_in_bootloader, 0, 0});
      else
        refuse(0, message.type, {message.known ? wire::Refusal::malformed : wire::Refusal::unknown_message});
    } else if constexpr (wire::is_update(Message::kType)) {
      handle_update(message);
    } else if constexpr (wire::delivery_of(Message::kType) == wire::Delivery::datagram) {
      if (schema_agreed_) handle(message);
    } else if (schema_agreed_) {
      handle(message);
    } else {
      refuse(message.request_id, static_cast<std::uint8_t>(Message::kType), {wire::Refusal::schema_mismatch});
    }
  }

  void handle(const wire::HelloRequest& request) {
    schema_agreed_ = request.schema_hash == wire::kSchemaHash;
    const Identity identity = board_.identity();
    wire::Hello hello;
    hello.request_id = request.request_id;
    hello.schema_hash = wire::kSchemaHash;
    hello.version_major = kVersionMajor;
    hello.version_minor = kVersionMinor;
    hello.version_patch = kVersionPatch;
    hello.board_id = identity.board_id;
    hello.boot_id = identity.boot_id;
    hello.tick_rate_Hz = static_cast<std::uint32_t>(kTicksPerSecond);
    hello.reset_cause = identity.reset_cause;
    answer(hello);
  }
  void handle(const wire::Heartbeat& heartbeat) { motion_.heartbeat(heartbeat.lease_id); }
  void handle(const wire::TimeSyncRequest& request) {
    const std::uint64_t received = on_wire(board_.now());
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    const wire::TimeSync reply{request.token, received, on_wire(board_.now())};
    (void)link_.send(wire::TimeSync::kType, wire::encode(reply, payload));
  }
  void handle(const wire::StatusRequest& request) {
    const MotionCounters counters = motion_.engine().counters();
    const Inputs inputs = board_.inputs();
    const wire::LinkCounters& link = link_.counters();
    wire::Status status;
    status.request_id = request.request_id;
    status.state = motion_.safety().state();
    status.fault = motion_.safety().fault();
    status.inputs = static_cast<std::uint8_t>((inputs.estop ? 1 : 0) | (inputs.home ? 2 : 0) |
                                              (inputs.far_limit ? 4 : 0) | (motion_.motor_enabled() ? 8 : 0));
    status.tick = on_wire(board_.now());
    status.position_microsteps = counters.position.count;
    status.segment = motion_.run().segment();
    status.cycle = counters.cycles_begun;
    status.triggers = counters.triggers;
    status.r_waves = counters.r_waves;
    status.steps = counters.steps;
    status.events_lost = motion_.events_lost();
    status.frames_received = link.frames_received;
    status.crc_errors = link.crc_errors;
    status.framing_errors = link.framing_errors;
    status.duplicates = link.duplicates;
    status.out_of_order = link.out_of_order;
    status.retransmissions = link.retransmissions;
    status.takes_unsigned_firmware = board_.takes_unsigned_firmware() ? 1 : 0;
    answer(status);
  }
  void handle(const wire::ReadSettings& request) {
    wire::SettingsReport report;
    report.request_id = request.request_id;
    report.records_written = store_.records_written();
    report.settings = store_.settings();
    report.microstep_pL = wire::microstep_pL(report.settings);
    report.backlash_microsteps = wire::backlash_microsteps(report.settings);
    answer(report);
  }
  void handle(const wire::ReadBlackBox& request) {
    answer(
        wire::BlackBoxReport{request.request_id, black_box_.newest(), black_box_.first_from(request.from)});
  }
  /// Only at rest: the flash holds the core up while it is written.
  void handle(const wire::WriteSettings& request) {
    const wire::SettingOutOfRange outside = wire::out_of_range(request.settings);
    if (outside.found) {
      conclude(request,
               PlanRefusal{wire::Refusal::setting_out_of_range, wire::Limit::none,
                           static_cast<std::uint16_t>(outside.setting), outside.asked, outside.allowed});
    } else if (!motion_.safety().at_rest()) {
      conclude(request, wire::Refusal::wrong_state);
    } else if (!board_.supply_sound()) {
      conclude(request, wire::Refusal::supply_low);
    } else if (!store_.write(request.settings)) {
      conclude(request, wire::Refusal::flash_failed);
    } else {
      motion_.use(store_.settings(), true);
      note(wire::Noted::settings, 0, static_cast<std::int32_t>(store_.records_written()));
      conclude(request, wire::Refusal::none);
    }
  }
  void handle_update(const wire::EnterBootloader& request) { conclude(request, trial_.enter_bootloader()); }
  void handle_update(const wire::ConfirmImage& request) {
    conclude(request, trial_.confirm(request.build_id));
  }
  void handle_update(const wire::ImageQuery& query) {
    const RunningImage image = board_.running_image();
    wire::ImageReport report;
    report.request_id = query.request_id;
    report.slot = image.slot;
    report.standing = image.state;
    report.version_major = image.version.major;
    report.version_minor = image.version.minor;
    report.version_patch = image.version.patch;
    report.build_id = image.build_id;
    report.code_bytes = report.held_bytes = image.code_bytes;
    report.link_address = image.link_address;
    report.free_slot = image.slot == wire::ImageSlot::a ? wire::ImageSlot::b : wire::ImageSlot::a;
    answer(report);
  }
  void handle(const wire::SelfTest& request) {
    const wire::Refusal refusal = motion_.self_test_refusal();
    if (refusal != wire::Refusal::none) return conclude(request, refusal);
    wire::SelfTestReport report = board_.self_test(request);
    report.request_id = request.request_id;
    answer(report);
  }
  void handle(const wire::Configure& request) { conclude(request, motion_.configure(request)); }
  void handle(const wire::ClearProgram& request) { conclude(request, motion_.clear_program()); }
  void handle(const wire::AddSegment& request) { conclude(request, motion_.add_segment(request)); }
  void handle(const wire::UploadWaveform& request) { conclude(request, motion_.upload(request)); }
  void handle(const wire::WaveformPoints& request) { conclude(request, motion_.upload(request)); }
  void handle(const wire::Arm& request) { conclude(request, motion_.arm(request)); }
  void handle(const wire::Home& request) { conclude(request, motion_.home(request.lease_id)); }
  void handle(const wire::Jog& request) { conclude(request, motion_.jog(request)); }
  void handle(const wire::Start& request) { conclude(request, motion_.start(request.lease_id)); }
  void handle(const wire::StopAtCycleEnd& request) { conclude(request, motion_.stop_at_cycle_end()); }
  void handle(const wire::StopNow& request) { conclude(request, motion_.stop_now()); }
  void handle(const wire::Halt& request) { conclude(request, motion_.halt()); }
  void handle(const wire::ClearFault& request) { conclude(request, motion_.clear_fault()); }

  template <class Request>
  void conclude(const Request& request, const PlanRefusal& why) {
    const auto type = static_cast<std::uint8_t>(Request::kType);
    if (why.refusal == wire::Refusal::none)
      answer(wire::Ack{request.request_id, type});
    else
      refuse(request.request_id, type, why);
  }
  template <class Request>
  void conclude(const Request& request, wire::UpdateOutcome outcome) {
    answer(wire::UpdateAnswer{request.request_id, static_cast<std::uint8_t>(Request::kType), outcome, 0, 0});
  }
  template <class Request>
  void conclude(const Request& request, wire::Refusal refusal) {
    conclude(request, PlanRefusal{.refusal = refusal});
  }
  void note(wire::Noted kind, std::uint8_t detail, std::int32_t argument) {
    black_box_.note(kind, detail, argument, board_.now());
  }
  void refuse(std::uint16_t request_id, std::uint8_t type, const PlanRefusal& why) {
    note(wire::Noted::refusal, static_cast<std::uint8_t>(why.refusal), type);
    answer(wire::Nak{request_id, type, why.refusal, why.limit, why.segment, why.asked, why.allowed});
  }
  /// A host that sends requests and takes no answers loses the session.
  template <class Message>
  void answer(const Message& message) {
    if (!outbox_.put(message)) link_.close();
  }

  B& board_;
  Motion<B>& motion_;
  Store& store_;
  BlackBox& black_box_;
  ImageTrial<B>& trial_;
  Outbox& outbox_;
  wire::ReliableLink& link_;
  std::uint32_t generation_ = 0;
  bool schema_agreed_ = false;
};

}  // namespace diastole::firmware
