#pragma once
// One session with application or bootloader, as far as an update needs it: requests and their answers.

#include <array>
#include <optional>
#include <random>
#include <type_traits>
#include <variant>

#include "host/transport/byte_line.hpp"
#include "host/transport/clock.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole {

class UpdateLink {
 public:
  /// Both outlive this.
  UpdateLink(Clock& clock, ByteLine& line)
      : clock_(clock), line_(line), session_(static_cast<uint16_t>(std::random_device{}())) {}

  /// Begins a new session; false if nobody answers in time. What was asked before is forgotten.
  bool open(uint64_t timeout_ns) {
    link_.open(++session_, clock_.now_ns() / ns_per_us);
    const uint64_t end_ns = clock_.now_ns() + timeout_ns;
    while (link_.state() == wire::ReliableLink::State::opening && alive() && clock_.now_ns() < end_ns)
      turn();
    return is_open();
  }
  /// True while the session lasts. A reset of the controller ends it, but shows only when something is sent.
  [[nodiscard]] bool is_open() const { return alive() && link_.state() == wire::ReliableLink::State::open; }

  /// Sends a request and returns its answer; nothing if the line does not take it in time, the answer does not come
  /// in time, or the session ends.
  template <class Answer, class Request>
  std::optional<Answer> ask(Request request, uint64_t timeout_ns) {
    request.request_id = ++last_request_;
    std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
    const auto bytes = wire::encode(request, memory);
    for (const uint64_t end_ns = clock_.now_ns() + line_timeout_ns; !link_.send(Request::kType, bytes);
         turn())
      if (!is_open() || clock_.now_ns() >= end_ns) return {};
    for (const uint64_t end_ns = clock_.now_ns() + timeout_ns;; turn()) {
      const auto* answer = std::get_if<Answer>(&answer_);
      if (answer != nullptr && answer->request_id == last_request_) return *answer;
      if (!is_open() || clock_.now_ns() >= end_ns) return {};
    }
  }

  /// Repeats StayInBootloader without pause, for a controller that is being reset by hand.
  void flood_stay(uint64_t time_ns) {
    constexpr size_t frames_a_turn =
        3;  // more than a millisecond's worth at 460,800 baud keeps the line full
    std::array<uint8_t, wire::kMaxPayloadBytes> payload{};
    std::array<uint8_t, wire::kMaxEncodedBytes> encoded{};
    const auto frame = wire::encode_frame(
        {session_, wire::FrameKind::datagram, static_cast<uint8_t>(wire::StayInBootloader::kType), 0, 0},
        wire::encode(wire::StayInBootloader{}, payload), encoded);
    const uint64_t end_ns = clock_.now_ns() + time_ns;
    while (clock_.now_ns() < end_ns && alive()) {
      for (size_t i = 0; i < frames_a_turn; ++i)
        line_.write(frame);
      turn();
    }
  }
  void pause(uint64_t time_ns) {
    const uint64_t end_ns = clock_.now_ns() + time_ns;
    while (clock_.now_ns() < end_ns && alive())
      turn();
  }

 private:
  using Answers = std::variant<wire::Hello, wire::ImageReport, wire::UpdateAnswer>;
  static constexpr uint64_t ns_per_us = 1'000;
  static constexpr uint64_t step_ns = 1'000'000;
  static constexpr uint64_t line_timeout_ns = 5'000'000'000;

  void turn() {
    for (auto bytes = link_.transmit(clock_.now_ns() / ns_per_us); !bytes.empty();
         bytes = link_.transmit(clock_.now_ns() / ns_per_us))
      line_.write(bytes);
    clock_.sleep_until_ns(clock_.now_ns() + step_ns, &line_);
    std::array<uint8_t, 512> block{};
    for (size_t count = line_.read(block); count > 0; count = line_.read(block)) {
      for (size_t i = 0; i < count; ++i) {
        if (const auto received = link_.receive(block[i], clock_.now_ns() / ns_per_us)) hear(*received);
      }
    }
  }
  void hear(const wire::Received& received) {
    wire::visit_message(received.type, received.payload, [this](const auto& message) {
      if constexpr (std::is_constructible_v<Answers, decltype(message)>) answer_ = message;
    });
  }
  [[nodiscard]] bool alive() const { return !line_.lost(); }

  Clock& clock_;
  ByteLine& line_;
  wire::ReliableLink link_{wire::ReliableLink::Role::host};
  uint16_t session_;
  uint16_t last_request_ = 0;
  Answers answer_;  // the newest
};

}  // namespace diastole
