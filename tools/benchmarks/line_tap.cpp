#include "tools/benchmarks/line_tap.hpp"

#include <poll.h>

#include <array>
#include <utility>

#include "host/transport/real_time.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole {
namespace {

constexpr unsigned baud = 460800;  // a pseudo-terminal has none
constexpr int look_interval_ms = 50;
constexpr int wire_priority = 60;  // a wire is not made late by other programs

}  // namespace

LineTap::LineTap(const std::string& controller, const std::string& link)
    : controller_(controller, baud),
      daemon_(link),
      thread_([this](const std::stop_token& stop) { carry(stop); }) {}

std::optional<LineTap::Instant> LineTap::take_stop() {
  const std::lock_guard lock(mutex_);
  return std::exchange(stop_, std::nullopt);
}

void LineTap::carry(const std::stop_token& stop) {
  ask_for_real_time(wire_priority);
  std::array<uint8_t, 4096> block{};
  while (!stop.stop_requested()) {
    daemon_.refresh();
    std::array<pollfd, 2> states{{{controller_.descriptor(), POLLIN, 0}, {daemon_.descriptor(), POLLIN, 0}}};
    ::poll(states.data(), states.size(), daemon_.descriptor() < 0 ? 1 : look_interval_ms);
    if (const auto bytes = daemon_.read(); !bytes.empty()) {
      look_at(bytes, std::chrono::steady_clock::now());
      controller_.write(bytes);
      controller_.flush(look_interval_ms);
    }
    while (const size_t got = controller_.read(block))
      daemon_.write(std::span(block).first(got));
    daemon_.send_queued();
  }
}

void LineTap::look_at(std::span<const uint8_t> bytes, Instant at) {
  for (const uint8_t byte : bytes) {
    const auto frame = decoder_.push(byte);
    if (!frame || !frame->ok()) continue;
    if ((*frame)->header.type != static_cast<uint8_t>(wire::MessageType::StopNow)) continue;
    const std::lock_guard lock(mutex_);
    if (!stop_) stop_ = at;
  }
}

}  // namespace diastole
