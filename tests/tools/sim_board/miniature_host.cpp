#include "tests/tools/sim_board/miniature_host.hpp"

namespace diastole::sim_board_test {

void MiniatureHost::hear(const wire::Received& received) {
  wire::visit_message(received.type, received.payload,
                      wire::overloaded{
                          [&](const wire::Hello& message) { hello = message; },
                          [&](const wire::Ack& message) {
                            acknowledged_ = true;
                            acknowledged.push_back(message.request_id);
                          },
                          [&](const wire::Nak& message) {
                            acknowledged_ = false;
                            refused.push_back(message.request_id);
                          },
                          [&](const wire::SegmentPlanned& message) { planned.push_back(message); },
                          [&](const wire::StateChanged& message) { state = message.to; },
                          [&](const wire::FaultRaised& message) { fault = message.fault; },
                          [&](const wire::Trigger& message) { triggers.push_back(message); },
                          [&](const wire::RunEnded& message) { ended = message; },
                          [&](const auto&) {},
                      });
}

bool MiniatureHost::heartbeat_due() {
  if (last_heartbeat_ns && last_heartbeat_sent_) return false;
  const bool last = last_heartbeat_ns && now_ns_ >= *last_heartbeat_ns;
  if (!last && now_ns_ < next_heartbeat_ns_) return false;
  last_heartbeat_sent_ = last;
  next_heartbeat_ns_ = now_ns_ + 50'000'000;
  return true;
}

void MiniatureHost::turn() {
  const uint64_t now_us = now_ns_ / 1000;
  if (link_.state() == wire::ReliableLink::State::open && heartbeat_due()) {
    std::array<uint8_t, wire::kMaxPayloadBytes> payload{};
    (void)link_.send(wire::Heartbeat::kType, wire::encode(wire::Heartbeat{lease}, payload));
  }
  for (auto bytes = link_.transmit(now_us); !bytes.empty(); bytes = link_.transmit(now_us)) {
    to_controller.push(bytes, now_us);
  }
  controller_.receive(to_controller.take(now_us));
  now_ns_ += slice_ns;
  const auto output = controller_.advance_to(now_ns_);
  edges.insert(edges.end(), output.edges.begin(), output.edges.end());
  to_host.push(output.sent, now_ns_ / 1000);
  for (const uint8_t byte : to_host.take(now_ns_ / 1000)) {
    if (const auto received = link_.receive(byte, now_ns_ / 1000)) hear(*received);
  }
}

void MiniatureHost::run_for(uint64_t time_ns) {
  const uint64_t end_ns = now_ns_ + time_ns;
  while (now_ns_ < end_ns)
    turn();
}

bool MiniatureHost::run_until(const std::function<bool()>& done, uint64_t most_ns) {
  const uint64_t end_ns = now_ns_ + most_ns;
  while (!done() && now_ns_ < end_ns)
    turn();
  return done();
}

bool MiniatureHost::connect() {
  run_for(20'000'000);  // the board starts
  link_.open(77, now_ns_ / 1000);
  run_until([&] { return link_.state() == wire::ReliableLink::State::open; }, 5'000'000'000);
  std::array<uint8_t, wire::kMaxPayloadBytes> payload{};
  const wire::HelloRequest request{++last_request_, wire::kSchemaHash, 0, 1, 0};
  if (!link_.send(wire::HelloRequest::kType, wire::encode(request, payload))) return false;
  run_until([&] { return hello.has_value(); }, 5'000'000'000);
  run_for(60'000'000);  // heartbeats count from Hello on
  return hello.has_value();
}

bool MiniatureHost::prepare() {
  wire::Home home{};
  home.lease_id = lease;
  if (!connect() || !ask(wire::Configure::example()) || !ask(home)) return false;
  run_until([&] { return state == wire::State::homed || state == wire::State::faulted; }, 60'000'000'000);
  run_for(50'000'000);
  return state == wire::State::homed;
}

bool MiniatureHost::run_program(uint64_t most_ns, wire::Arm arm) {
  wire::Start start{};
  start.lease_id = lease;
  ended.reset();
  if (!ask(arm) || !ask(start)) return false;
  const bool done = run_until([&] { return ended.has_value(); }, most_ns);
  run_for(100'000'000);
  return done;
}

}  // namespace diastole::sim_board_test
