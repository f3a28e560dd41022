#include "host/controller/controller_link.hpp"

#include <algorithm>
#include <random>
#include <utility>

namespace diastole {
namespace {

constexpr uint64_t ns_per_ms = 1'000'000;
constexpr uint64_t ns_per_us = 1'000;
constexpr uint64_t heartbeat_interval_ns = 50 * ns_per_ms;
constexpr uint64_t time_question_interval_ns = 250 * ns_per_ms;
constexpr uint64_t time_answer_patience_ns = 20 * ns_per_ms;
constexpr uint64_t fine_step_ns = 200 * ns_per_us;  // while an answer is awaited
constexpr uint64_t open_patience_ns = 1'500 * ns_per_ms;
constexpr uint64_t silence_patience_ns = 1'000 * ns_per_ms;

}  // namespace

ControllerLink::ControllerLink(Clock& clock, Hooks hooks) : clock_(clock), hooks_(std::move(hooks)) {
  std::random_device random;
  session_ = static_cast<uint16_t>(random());
  lease_id_ = random() | 1U;
}

bool ControllerLink::open(std::unique_ptr<ByteLine> line) {
  line_ = std::move(line);
  clock_.line_opened(*line_);
  link_.open(++session_, clock_.now_ns() / ns_per_us);
  const uint64_t end_ns = clock_.now_ns() + open_patience_ns;
  const auto is_open = [this] { return link_.state() == wire::ReliableLink::State::open; };
  while (!is_open() && has_line() && clock_.now_ns() < end_ns)
    turn();
  if (is_open()) return true;
  close();
  return false;
}

void ControllerLink::close() {
  link_.close();
  line_.reset();
  greeted_ = false;
  time_asked_ns_ = 0;
}

void ControllerLink::greeted() {
  greeted_ = true;
  next_time_question_ns_ = next_heartbeat_ns_ = clock_.now_ns();
}

uint64_t ControllerLink::next_due_ns() const {
  if (!greeted_) return UINT64_MAX;
  const uint64_t due_ns = std::min(next_heartbeat_ns_, next_time_question_ns_);
  return time_asked_ns_ != 0 ? std::min(due_ns, clock_.now_ns() + fine_step_ns) : due_ns;
}

void ControllerLink::service() {
  if (line_ == nullptr) return;
  receive();
  if (link_.state() == wire::ReliableLink::State::lost) return hooks_.broke("the controller was reset");
  if (line_->lost()) return hooks_.broke("the serial line is gone");
  keep_alive();
  transmit();
}

void ControllerLink::turn() {
  service();
  if (line_ == nullptr) return;
  clock_.sleep_until_ns(clock_.now_ns() + fine_step_ns, line_.get());
  service();
}

void ControllerLink::receive() {
  std::array<uint8_t, 512> block{};
  const uint64_t now_us = clock_.now_ns() / ns_per_us;
  for (size_t count = line_->read(block); count > 0; count = line_->read(block)) {
    for (size_t i = 0; i < count; ++i)
      if (const auto message = link_.receive(block[i], now_us)) hooks_.received(*message);
  }
}

void ControllerLink::transmit() {
  if (line_ == nullptr) return;
  const uint64_t now_us = clock_.now_ns() / ns_per_us;
  for (auto bytes = link_.transmit(now_us); !bytes.empty(); bytes = link_.transmit(now_us))
    line_->write(bytes);
}

void ControllerLink::keep_alive() {
  if (!greeted_) return;
  const uint64_t now_ns = clock_.now_ns();
  const uint64_t heard_ns = link_.last_heard_us() * ns_per_us;
  if (now_ns > heard_ns + silence_patience_ns) return hooks_.broke("the controller has fallen silent");
  if (now_ns >= next_heartbeat_ns_) {
    send(wire::Heartbeat{.lease_id = lease_id_});
    next_heartbeat_ns_ = now_ns + heartbeat_interval_ns;
  }
  if (time_asked_ns_ != 0 && now_ns > time_asked_ns_ + time_answer_patience_ns) time_asked_ns_ = 0;
  if (now_ns >= next_time_question_ns_) ask_time();
  hooks_.serviced();
}

void ControllerLink::ask_time() {
  time_asked_ns_ = clock_.now_ns();
  next_time_question_ns_ = time_asked_ns_ + time_question_interval_ns;
  send(wire::TimeSyncRequest{.token = ++time_token_});
}

std::optional<ClockReading> ControllerLink::take(const wire::TimeSync& sync) {
  if (sync.token != time_token_ || time_asked_ns_ == 0) return std::nullopt;
  const uint64_t asked_ns = std::exchange(time_asked_ns_, 0);
  const uint64_t half_ns = (clock_.now_ns() - asked_ns) / 2;
  return ClockReading{asked_ns + half_ns, sync.received_tick + (sync.replied_tick - sync.received_tick) / 2,
                      half_ns};
}

}  // namespace diastole
