#include "tests/firmware/bench.hpp"

#include "tests/firmware/uploads.hpp"

namespace diastole::firmware {

void Bench::hear(const wire::Received& received) {
  wire::visit_message(received.type, received.payload,
                      wire::overloaded{
                          [&](const wire::Hello& message) {
                            heard.hellos.push_back(message);
                            heard.answers.push_back({message.request_id, wire::Refusal::none});
                          },
                          [&](const wire::Ack& message) {
                            heard.acks.push_back(message);
                            heard.answers.push_back({message.request_id, wire::Refusal::none});
                          },
                          [&](const wire::Nak& message) {
                            heard.naks.push_back(message);
                            heard.answers.push_back({message.request_id, message.refusal});
                          },
                          [&](const wire::Status& message) {
                            heard.statuses.push_back(message);
                            heard.answers.push_back({message.request_id, wire::Refusal::none});
                          },
                          [&](const wire::SettingsReport& message) {
                            heard.settings.push_back(message);
                            heard.answers.push_back({message.request_id, wire::Refusal::none});
                          },
                          [&](const wire::BlackBoxReport& message) {
                            heard.black_box.push_back(message);
                            heard.answers.push_back({message.request_id, wire::Refusal::none});
                          },
                          [&](const wire::UpdateAnswer& message) { heard.updates.push_back(message); },
                          [&](const wire::ImageReport& message) { heard.images.push_back(message); },
                          [&](const wire::SegmentPlanned& message) { heard.planned.push_back(message); },
                          [&](const wire::StateChanged& message) { heard.states.push_back(message); },
                          [&](const wire::RunStarted& message) { heard.started.push_back(message); },
                          [&](const wire::SegmentStarted& message) { heard.segments.push_back(message); },
                          [&](const wire::Trigger& message) { heard.triggers.push_back(message); },
                          [&](const wire::RunEnded& message) { heard.ended.push_back(message); },
                          [&](const wire::FaultRaised& message) { heard.faults.push_back(message); },
                          [&](const wire::PositionBatch& batch) {
                            heard.positions_contiguous &= batch.first_index == heard.positions.size();
                            for (std::size_t i = 0; i < batch.count; ++i) {
                              heard.positions.push_back(batch.position_microsteps[i]);
                              heard.position_ticks.push_back(batch.first_tick + i * batch.period_ticks);
                            }
                          },
                          [&](const wire::TimeSync&) {},
                          [&](const wire::Undecodable&) { ++heard.undecodable; },
                          [&]<class Message>(const Message&) {
                            if (wire::sender_of(Message::kType) == wire::Sender::host) ++heard.undecodable;
                          },
                      });
}

void Bench::turn() {
  if (heartbeats && rig.now() >= next_heartbeat_ && link.state() == wire::ReliableLink::State::open) {
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    (void)link.send(wire::Heartbeat::kType, wire::encode(wire::Heartbeat{kLease}, payload));
    next_heartbeat_ = rig.now() + microseconds(50'000);
  }
  for (auto bytes = link.transmit(now_us()); !bytes.empty(); bytes = link.transmit(now_us()))
    to_controller.push(bytes, now_us());
  const std::vector<std::uint8_t> arrived = to_controller.take(now_us());
  if (cable) rig.feed(arrived);
  rig.advance_to(rig.now() + microseconds(1'000));
  to_host.push(rig.take_output(), now_us());
  const std::vector<std::uint8_t> sent = to_host.take(now_us());
  if (!cable) return;
  for (const std::uint8_t byte : sent)
    if (const auto received = link.receive(byte, now_us())) hear(*received);
}

void Bench::run_for(Ticks time) {
  const Ticks end = rig.now() + time;
  while (rig.now() < end)
    turn();
}

bool Bench::run_until(const std::function<bool()>& done, Ticks most) {
  const Ticks end = rig.now() + most;
  while (!done() && rig.now() < end)
    turn();
  return done();
}

void Bench::connect() {
  link.open(static_cast<std::uint16_t>(random()), now_us());
  run_until([&] { return link.state() == wire::ReliableLink::State::open; }, microseconds(5'000'000));
  const std::size_t before = heard.hellos.size();
  request(wire::HelloRequest{0, wire::kSchemaHash, 0, 1, 0});
  run_until([&] { return heard.hellos.size() > before; }, microseconds(5'000'000));
  run_for(microseconds(60'000));  // heartbeats count from Hello on
}

void Bench::prepare(const wire::Configure& configure) {
  connect();
  ask(configure);
  ask(wire::Home{0, kLease});
  run_until([&] { return state() == wire::State::homed || state() == wire::State::faulted; },
            microseconds(60'000'000));
  run_for(microseconds(50'000));
}

void Bench::add_segment(wire::Waveform waveform, std::uint32_t cycles, std::uint32_t stroke_nL,
                        std::uint32_t period_us, std::uint32_t offset_nL, std::uint8_t upload) {
  ask(wire::AddSegment{0, waveform, cycles, stroke_nL, offset_nL, period_us, upload});
}

bool Bench::upload(std::uint8_t number, std::span<const std::int16_t> rises) {
  if (!ask(upload_of(number, rises))) return false;
  for (std::size_t first = 0; first < rises.size(); first += wire::WaveformPoints::kMaxCount)
    if (!ask(lot_of(rises, first))) return false;
  return true;
}

void Bench::run_program(wire::Arm arm, Ticks most) {
  if (!ask(arm)) return;
  if (!ask(wire::Start{0, kLease})) return;
  const std::size_t before = heard.ended.size();
  run_until([&] { return heard.ended.size() > before; }, most);
  run_for(microseconds(100'000));
}

}  // namespace diastole::firmware
