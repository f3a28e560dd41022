#include "tools/benchmarks/emulated_session.hpp"

#include <algorithm>

namespace diastole {
namespace {

constexpr uint64_t slice_ns = 1'000'000;
constexpr uint64_t heartbeat_ns = 50'000'000;
/// What a slice carries at 460800 baud, and a little more.
constexpr std::size_t flood_bytes = 60;

}  // namespace

EmulatedSession::EmulatedSession(const std::string& image, board_model::FlashTiming timing)
    : controller_(std::vector{read_image(image)}, {}, {.flash_timing = timing}) {}

void EmulatedSession::hear(const wire::Received& received) {
  wire::visit_message(received.type, received.payload,
                      wire::overloaded{
                          [&](const wire::Hello&) { greeted_ = true; },
                          [&](const wire::Ack&) { acknowledged_ = true; },
                          [&](const wire::Nak& message) {
                            acknowledged_ = false;
                            refused = message;
                          },
                          [&](const wire::StateChanged& message) { state = message.to; },
                          [&](const wire::FaultRaised& message) { fault = message.fault; },
                          [&](const wire::RunEnded& message) { ended = message; },
                          [&](const auto&) {},
                      });
}

void EmulatedSession::speak() {
  const bool open = link_.state() == wire::ReliableLink::State::open;
  if (open && heartbeats && now_ns_ >= next_heartbeat_ns_) {
    (void)post(wire::Heartbeat{lease});
    next_heartbeat_ns_ = now_ns_ + heartbeat_ns;
  }
  const auto transmit = [&] {
    for (auto bytes = link_.transmit(now_ns_ / 1000); !bytes.empty(); bytes = link_.transmit(now_ns_ / 1000))
      controller_.receive(bytes);
  };
  transmit();
  while (open && flood && controller_.board().bytes_on_the_way() < flood_bytes) {
    (void)post(wire::Heartbeat{lease});
    if (++flooded_ % 8 == 0) (void)post(wire::TimeSyncRequest{flooded_});
    transmit();
  }
}

void EmulatedSession::run_to(uint64_t time_ns) {
  while (now_ns_ < time_ns) {
    speak();
    now_ns_ = std::min(time_ns, now_ns_ + slice_ns);
    const auto output = controller_.advance_to(now_ns_);
    for (const sim_controller::PinEdge& edge : output.edges) {
      if (edge.value == 1 && edge.pin == sim_controller::Pin::step) ++steps;
      if (edge.value == 1 && edge.pin == sim_controller::Pin::ttl) ++triggers;
      if (on_edge) on_edge(edge);
    }
    for (const uint8_t byte : output.sent) {
      if (const auto received = link_.receive(byte, now_ns_ / 1000)) hear(*received);
    }
  }
}

bool EmulatedSession::run_until(const std::function<bool()>& done, uint64_t most_ns) {
  const uint64_t end_ns = now_ns_ + most_ns;
  while (!done() && now_ns_ < end_ns)
    run_for(slice_ns);
  return done();
}

bool EmulatedSession::prepare(const wire::Configure& configure) {
  run_for(20'000'000);  // the board starts
  link_.open(77, now_ns_ / 1000);
  run_until([&] { return link_.state() == wire::ReliableLink::State::open; }, 5'000'000'000);
  if (!post(wire::HelloRequest{0, wire::kSchemaHash, 0, 1, 0})) return false;
  if (!run_until([&] { return greeted_; }, 5'000'000'000)) return false;
  run_for(60'000'000);  // heartbeats count from Hello on
  wire::Home home{};
  home.lease_id = lease;
  if (!ask(configure) || !ask(home)) return false;
  run_until([&] { return state == wire::State::homed || state == wire::State::faulted; }, 60'000'000'000);
  run_for(50'000'000);
  return state == wire::State::homed;
}

bool EmulatedSession::start() {
  ended.reset();
  wire::Start start{};
  start.lease_id = lease;
  return ask(start);
}

}  // namespace diastole
