#pragma once
// A host in miniature: speaks the real protocol with whatever stands behind sim_controller::SimulatedController, in
// that controller's time, and keeps the pin edges. The same session can so be held with the firmware built
// for this machine and with its image on the emulated board.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"
#include "tests/link_faults/line_faults.hpp"
#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_board_test {

class MiniatureHost {
 public:
  static constexpr uint32_t lease = 0x5ea5e;

  explicit MiniatureHost(sim_controller::SimulatedController& controller) : controller_(controller) {}

  /// Opens a session and says hello; false when nobody answers within 5 s.
  bool connect();
  /// connect, configure, home; true when homed.
  bool prepare();
  /// Sends a request and waits for its Ack (true) or anything else (false).
  template <class Request>
  bool ask(Request request) {
    acknowledged_.reset();
    if (!post(request)) return false;
    run_until([&] { return acknowledged_.has_value(); }, 3'000'000'000);
    return acknowledged_.value_or(false);
  }
  /// Sends a request and waits for nothing; its number, or nullopt if the link has no room for it.
  template <class Request>
  std::optional<uint16_t> post(Request request) {
    std::array<uint8_t, wire::kMaxPayloadBytes> payload{};
    request.request_id = static_cast<uint16_t>(last_request_ + 1);
    if (!link_.send(Request::kType, wire::encode(request, payload))) return std::nullopt;
    return ++last_request_;
  }
  /// Arms and starts what was added; true when the run ended by itself within `most_ns`.
  bool run_program(uint64_t most_ns, wire::Arm arm = wire::Arm::example());

  void run_for(uint64_t time_ns);
  bool run_until(const std::function<bool()>& done, uint64_t most_ns);

  [[nodiscard]] const wire::ReliableLink& link() const { return link_; }
  [[nodiscard]] uint64_t now_ns() const { return now_ns_; }

  std::optional<wire::Hello> hello;
  wire::State state = wire::State::unhomed;
  wire::Fault fault = wire::Fault::none;
  std::optional<wire::RunEnded> ended;
  std::vector<sim_controller::PinEdge> edges;
  std::vector<wire::Trigger> triggers;
  std::vector<uint16_t> acknowledged, refused;  ///< requests, in the order of their answers
  std::vector<wire::SegmentPlanned> planned;
  link_faults::LineFaults to_controller{{}, 1}, to_host{{}, 2};
  uint64_t slice_ns = 1'000'000;
  /// A last heartbeat is sent then, and none after it until this is reset.
  std::optional<uint64_t> last_heartbeat_ns;

 private:
  void turn();
  [[nodiscard]] bool heartbeat_due();
  void hear(const wire::Received& received);

  sim_controller::SimulatedController& controller_;
  wire::ReliableLink link_{wire::ReliableLink::Role::host};
  std::optional<bool> acknowledged_;  ///< the last answer
  uint64_t now_ns_ = 0, next_heartbeat_ns_ = 0;
  bool last_heartbeat_sent_ = false;
  uint16_t last_request_ = 0;
};

}  // namespace diastole::sim_board_test
