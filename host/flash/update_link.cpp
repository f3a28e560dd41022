#include "host/flash/update_link.hpp"

#include <random>

namespace diastole {
namespace {

constexpr uint64_t ns_per_us = 1'000;

}  // namespace

UpdateLink::UpdateLink(Clock& clock, ByteLine& line)
    : clock_(clock), line_(line), session_(static_cast<uint16_t>(std::random_device{}())) {}

bool UpdateLink::is_open() const { return alive() && link_.state() == wire::ReliableLink::State::open; }

bool UpdateLink::open(uint64_t patience_ns) {
  hellos_.clear();
  reports_.clear();
  answers_.clear();
  link_.open(++session_, clock_.now_ns() / ns_per_us);
  const uint64_t end_ns = clock_.now_ns() + patience_ns;
  while (link_.state() == wire::ReliableLink::State::opening && alive() && clock_.now_ns() < end_ns)
    turn();
  return is_open();
}

void UpdateLink::turn() {
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

void UpdateLink::hear(const wire::Received& received) {
  wire::visit_message(received.type, received.payload,
                      wire::overloaded{
                          [&](const wire::Hello& m) { hellos_.push_back(m); },
                          [&](const wire::ImageReport& m) { reports_.push_back(m); },
                          [&](const wire::UpdateAnswer& m) { answers_.push_back(m); },
                          [&](const auto&) {},
                      });
}

void UpdateLink::flood_stay(uint64_t time_ns) {
  constexpr size_t frames_a_turn = 3;  // more than a millisecond's worth at 460,800 baud keeps the line full
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

void UpdateLink::pause(uint64_t time_ns) {
  const uint64_t end_ns = clock_.now_ns() + time_ns;
  while (clock_.now_ns() < end_ns && alive())
    turn();
}

}  // namespace diastole
