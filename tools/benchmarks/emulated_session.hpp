#pragma once
// A session with the controller's image on the emulated board, held by the smallest host that speaks the
// protocol: what benchmarks and tests of the step path drive and measure.
//
//   EmulatedSession session("build/firmware/bin/diastole-stm32f405.elf");
//   session.prepare(configure);                                  // connected, configured, homed
//   session.ask(segment);  session.ask(arm);  session.start();
//   session.run_until([&] { return session.ended.has_value(); }, 10 s);

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"
#include "tools/sim_board/emulated_controller.hpp"

namespace diastole {

class EmulatedSession {
 public:
  static constexpr uint32_t lease = 0x5ea5e;

  /// Powers the board on. Throws InputError when the image cannot be read.
  explicit EmulatedSession(const std::string& image,
                           board_model::FlashTiming timing = board_model::FlashTiming::hits);

  /// Connects, configures and homes; true when homed.
  bool prepare(const wire::Configure& configure);
  /// Sends a request and waits for its Ack (true) or its Nak (false, kept in `refused`).
  template <class Request>
  bool ask(Request request) {
    acknowledged_.reset();
    if (!post(request)) return false;
    run_until([&] { return acknowledged_.has_value(); }, 3'000'000'000);
    return acknowledged_.value_or(false);
  }
  /// Sends a request and waits for nothing.
  template <class Request>
  bool post(Request request) {
    if constexpr (requires { request.request_id; }) request.request_id = ++last_request_;
    std::array<uint8_t, wire::kMaxPayloadBytes> payload{};
    return link_.send(Request::kType, wire::encode(request, payload));
  }
  /// Starts what has been armed.
  bool start();

  void run_for(uint64_t time_ns) { run_to(now_ns_ + time_ns); }
  void run_to(uint64_t time_ns);
  /// Asks after every millisecond; false when `most_ns` have passed without.
  bool run_until(const std::function<bool()>& done, uint64_t most_ns);

  [[nodiscard]] uint64_t now_ns() const { return now_ns_; }
  [[nodiscard]] EmulatedController& controller() { return controller_; }
  [[nodiscard]] BoardStatistics statistics() { return controller_.board().statistics(); }

  bool heartbeats = true;
  /// The line to the controller is never idle: heartbeats back to back, every eighth frame a question.
  bool flood = false;
  /// Called with every change of a pin.
  std::function<void(const sim_controller::PinEdge&)> on_edge;

  wire::State state = wire::State::unhomed;
  wire::Fault fault = wire::Fault::none;
  std::optional<wire::Nak> refused;
  std::optional<wire::RunEnded> ended;
  uint64_t steps = 0, triggers = 0;  ///< rising edges of STEP and TTL

 private:
  void speak();
  void hear(const wire::Received& received);

  EmulatedController controller_;
  wire::ReliableLink link_{wire::ReliableLink::Role::host};
  std::optional<bool> acknowledged_;
  bool greeted_ = false;
  uint64_t now_ns_ = 0, next_heartbeat_ns_ = 0;
  uint16_t last_request_ = 0;
  uint32_t flooded_ = 0;
};

}  // namespace diastole
