#pragma once
// The bootloader over its hardware: decides what to start, and serves updates on the serial line when it is
// asked to stay or has nothing to start. Hardware-free, so that the host's tests run the same sources.
//
//   Bootloader<Hardware> bootloader(hardware);
//   Start start = bootloader.run(asked_to_stay);   // returns when something is to be started

#include "firmware/boot/update_session.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::boot {

template <class H>
concept BootHardware = SlotStore<H> &&
    requires(H& hardware, const H& fixed, std::span<const std::uint8_t> bytes) {
  { fixed.now_us() } -> std::same_as<std::uint64_t>;
  { hardware.serial_read() } -> std::same_as<std::optional<std::uint8_t>>;
  { fixed.serial_room() } -> std::same_as<std::size_t>;
  /// Precondition: bytes.size() <= serial_room().
  {hardware.serial_write(bytes)};
  {hardware.feed_watchdog()};
  /// Waits for the next interrupt, at most a millisecond.
  {hardware.idle()};
  { fixed.boot_id() } -> std::same_as<std::uint32_t>;
  { fixed.reset_cause() } -> std::same_as<wire::ResetCause>;
};

struct Start {
  wire::ImageSlot slot = wire::ImageSlot::none;  ///< none: reset, and decide anew
  bool trial = false;
};

/// How long a host may ask for the bootloader after a reset.
inline constexpr std::uint64_t kStayWindow_us = 30'000;
/// After this silence of the line a bootloader with something to start starts it.
inline constexpr std::uint64_t kIdleTimeout_us = 30'000'000;
/// Of the bootloader itself, as Hello reports it.
inline constexpr wire::FirmwareVersion kBootloaderVersion{1, 1, 0};

template <BootHardware H>
class Bootloader {
 public:
  explicit Bootloader(H& hardware) : hardware_(hardware), session_(hardware) {}

  Start run(bool asked_to_stay);

 private:
  static constexpr std::uint64_t kLastAnswer_us = 100'000;

  bool stay_requested(std::uint64_t until_us);
  /// One turn of serving; false when the bootloader is to be left.
  bool serve_turn();
  void receive(const wire::Received& received);
  template <class Message>
  void with(std::span<const std::uint8_t> payload);
  void handle(const wire::HelloRequest& request);
  void handle(const wire::ImageQuery& query);
  void handle(const wire::BeginUpdate& request) { answer(request, session_.begin(request)); }
  void handle(const wire::UpdateData& request) { answer(request, session_.add(request)); }
  void handle(const wire::FinishUpdate& request) { answer(request, session_.finish()); }
  void handle(const wire::StartImage& request);
  template <class Message>
  void answer(const Message& request, const UpdateReply& reply) {
    send(wire::UpdateAnswer{request.request_id, static_cast<std::uint8_t>(Message::kType), reply.outcome,
                            session_.held_bytes(), reply.value});
  }
  template <class Message>
  void send(const Message& message);

  H& hardware_;
  wire::ReliableLink link_{wire::ReliableLink::Role::controller};
  UpdateSession<H> session_;
  std::uint64_t heard_us_ = 0;
  std::optional<std::uint64_t> leave_at_us_;
};

template <BootHardware H>
Start Bootloader<H>::run(bool asked_to_stay) {
  const std::uint64_t window_end_us = hardware_.now_us() + kStayWindow_us;
  const BootDecision decision = decide(hardware_);
  if (asked_to_stay || decision.start == wire::ImageSlot::none || stay_requested(window_end_us)) {
    heard_us_ = hardware_.now_us();
    while (serve_turn()) {
    }
    return {};
  }
  if (!decision.trial) {
    record_counter(hardware_, decision);
    return {decision.start, false};
  }
  const SlotFacts facts = inspect(hardware_, decision.start);
  if (append(hardware_, {BootEvent::tried, decision.start, facts.tag})) return {decision.start, true};
  return {decision.keep != wire::ImageSlot::none ? decision.keep : decision.start, false};
}

/// What has come while the images were judged counts too.
template <BootHardware H>
bool Bootloader<H>::stay_requested(std::uint64_t until_us) {
  wire::FrameDecoder decoder;
  for (;;) {
    const auto byte = hardware_.serial_read();
    if (!byte) {
      if (hardware_.now_us() >= until_us) return false;
      hardware_.idle();
      continue;
    }
    const auto outcome = decoder.push(*byte);
    if (!outcome || !outcome->ok()) continue;
    const wire::Frame& frame = outcome->value();
    if (frame.header.kind == wire::FrameKind::datagram &&
        frame.header.type == static_cast<std::uint8_t>(wire::MessageType::StayInBootloader) &&
        wire::decode<wire::StayInBootloader>(frame.payload).ok())
      return true;
  }
}

template <BootHardware H>
bool Bootloader<H>::serve_turn() {
  hardware_.feed_watchdog();
  while (const auto byte = hardware_.serial_read()) {
    const auto received = link_.receive(*byte, hardware_.now_us());
    if (!received) continue;
    heard_us_ = hardware_.now_us();
    receive(*received);
  }
  while (hardware_.serial_room() >= wire::kMaxEncodedBytes) {
    const auto bytes = link_.transmit(hardware_.now_us());
    if (bytes.empty()) break;
    hardware_.serial_write(bytes);
  }
  hardware_.idle();
  const std::uint64_t now_us = hardware_.now_us();
  if (leave_at_us_) return now_us < *leave_at_us_ && !link_.idle();
  if (now_us - heard_us_ < kIdleTimeout_us) return true;
  heard_us_ = now_us;
  return decide(hardware_).start == wire::ImageSlot::none;
}

template <BootHardware H>
void Bootloader<H>::receive(const wire::Received& received) {
  switch (static_cast<wire::MessageType>(received.type)) {
    case wire::MessageType::HelloRequest:
      return with<wire::HelloRequest>(received.payload);
    case wire::MessageType::ImageQuery:
      return with<wire::ImageQuery>(received.payload);
    case wire::MessageType::BeginUpdate:
      return with<wire::BeginUpdate>(received.payload);
    case wire::MessageType::UpdateData:
      return with<wire::UpdateData>(received.payload);
    case wire::MessageType::FinishUpdate:
      return with<wire::FinishUpdate>(received.payload);
    case wire::MessageType::StartImage:
      return with<wire::StartImage>(received.payload);
    default:
      if (received.delivery == wire::Delivery::sequenced)
        send(wire::UpdateAnswer{0, received.type, wire::UpdateOutcome::malformed, 0, 0});
  }
}

template <BootHardware H>
template <class Message>
void Bootloader<H>::with(std::span<const std::uint8_t> payload) {
  Message message;
  wire::FieldReader reader(payload);
  Message::layout(message, reader);
  if (reader.fault().problem == wire::DecodeProblem::none) return handle(message);
  send(
      wire::UpdateAnswer{0, static_cast<std::uint8_t>(Message::kType), wire::UpdateOutcome::malformed, 0, 0});
}

template <BootHardware H>
void Bootloader<H>::handle(const wire::HelloRequest& request) {
  wire::Hello hello;
  hello.request_id = request.request_id;
  hello.schema_hash = wire::kBootloaderSchema;
  hello.version_major = kBootloaderVersion.major;
  hello.version_minor = kBootloaderVersion.minor;
  hello.version_patch = kBootloaderVersion.patch;
  hello.board_id = hardware_.board_id();
  hello.boot_id = hardware_.boot_id();
  hello.reset_cause = hardware_.reset_cause();
  send(hello);
}

template <BootHardware H>
void Bootloader<H>::handle(const wire::ImageQuery& query) {
  const BootDecision decision = decide(hardware_);
  wire::ImageReport report;
  report.request_id = query.request_id;
  report.slot = query.slot;
  report.free_slot = decision.free;
  if (query.slot != wire::ImageSlot::none) {
    report.standing = decision.state[static_cast<std::size_t>(query.slot)];
    report.link_address = hardware_.slot_address(query.slot);
    if (const auto header = header_in(hardware_.slot(query.slot))) {
      report.version_major = header->version.major;
      report.version_minor = header->version.minor;
      report.version_patch = header->version.patch;
      report.build_id = header->build_id;
      report.code_bytes = header->code_bytes;
      if (report.standing == wire::ImageState::incomplete &&
          header->code_bytes <= hardware_.slot(query.slot).size() - wire::kImageHeaderArea)
        report.held_bytes = held_code(hardware_.slot(query.slot), header->code_bytes);
      else
        report.held_bytes = header->code_bytes;
    }
  }
  send(report);
}

template <BootHardware H>
void Bootloader<H>::handle(const wire::StartImage& request) {
  if (decide(hardware_).start == wire::ImageSlot::none)
    return answer(request, {wire::UpdateOutcome::nothing_to_start, 0});
  answer(request, {});
  leave_at_us_ = hardware_.now_us() + kLastAnswer_us;
}

template <BootHardware H>
template <class Message>
void Bootloader<H>::send(const Message& message) {
  std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
  if (!link_.send(Message::kType, wire::encode(message, payload))) link_.close();
}

}  // namespace diastole::boot
