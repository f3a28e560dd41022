#pragma once
// One session with the controller over its serial line: bytes to messages and back, and once it is greeted the
// heartbeat that keeps the lease, the questions of time that the clock map rests on, and the watch for silence.

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "host/controller/controller.hpp"
#include "host/transport/clock.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole {

class ControllerLink {
 public:
  struct Hooks {
    std::function<void(const wire::Received&)> received;
    std::function<void(std::string reason)> broke;  ///< reset, silent, or the line is gone
    std::function<void()> serviced;                 ///< at the end of each service() of a greeted controller
  };

  ControllerLink(Clock& clock, Hooks hooks) : clock_(clock), hooks_(std::move(hooks)) {
    std::random_device random;
    session_ = static_cast<uint16_t>(random());
    lease_id_ = random() | 1U;
  }

  /// Begins a session on this line; false, and closed again, if nobody answers in time.
  bool open(std::unique_ptr<ByteLine> line) {
    line_ = std::move(line);
    clock_.line_opened(*line_);
    link_.open(++session_, clock_.now_ns() / ns_per_us);
    const uint64_t end_ns = clock_.now_ns() + open_timeout_ns;
    const auto is_open = [this] { return link_.state() == wire::ReliableLink::State::open; };
    while (!is_open() && has_line() && clock_.now_ns() < end_ns)
      turn();
    if (is_open()) return true;
    close();
    return false;
  }
  void close() {
    link_.close();
    line_.reset();
    greeted_ = false;
    time_asked_ns_ = 0;
  }
  [[nodiscard]] bool has_line() const { return line_ != nullptr; }
  [[nodiscard]] ByteLine* line() { return line_.get(); }

  /// The controller has introduced itself: from now on it is kept alive. The first order may follow at once.
  void greeted() {
    greeted_ = true;
    next_time_question_ns_ = next_heartbeat_ns_ = clock_.now_ns();
  }
  /// The next service() sends a heartbeat.
  void beat_at_once() { next_heartbeat_ns_ = clock_.now_ns(); }
  [[nodiscard]] uint32_t lease_id() const { return lease_id_; }
  /// The two clocks' reading that this answer completes, if it is the last question's.
  std::optional<ClockReading> take(const wire::TimeSync& sync) {
    if (sync.token != time_token_ || time_asked_ns_ == 0) return std::nullopt;
    const uint64_t asked_ns = std::exchange(time_asked_ns_, 0);
    const uint64_t half_ns = (clock_.now_ns() - asked_ns) / 2;
    return ClockReading{asked_ns + half_ns, sync.received_tick + (sync.replied_tick - sync.received_tick) / 2,
                        half_ns};
  }

  template <class Message>
  void send(const Message& message) {
    std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
    (void)link_.send(Message::kType, wire::encode(message, memory));
  }
  void transmit() {
    if (line_ == nullptr) return;
    const uint64_t now_us = clock_.now_ns() / ns_per_us;
    for (auto bytes = link_.transmit(now_us); !bytes.empty(); bytes = link_.transmit(now_us))
      line_->write(bytes);
  }
  /// Takes in what arrived and sends what is due.
  void service() {
    if (line_ == nullptr) return;
    receive();
    if (link_.state() == wire::ReliableLink::State::lost) return hooks_.broke("the controller was reset");
    if (line_->lost()) return hooks_.broke("the serial line is gone");
    keep_alive();
    transmit();
  }
  /// The same before and after a short sleep.
  void turn() {
    service();
    if (line_ == nullptr) return;
    clock_.sleep_until_ns(clock_.now_ns() + fine_step_ns, line_.get());
    service();
  }
  /// When service() has something to send next.
  [[nodiscard]] uint64_t next_due_ns() const {
    if (!greeted_) return UINT64_MAX;
    const uint64_t due_ns = std::min(next_heartbeat_ns_, next_time_question_ns_);
    return time_asked_ns_ != 0 ? std::min(due_ns, clock_.now_ns() + fine_step_ns) : due_ns;
  }

 private:
  static constexpr uint64_t ns_per_ms = 1'000'000;
  static constexpr uint64_t ns_per_us = 1'000;
  static constexpr uint64_t heartbeat_interval_ns = 50 * ns_per_ms;
  static constexpr uint64_t time_question_interval_ns = 250 * ns_per_ms;
  static constexpr uint64_t time_answer_timeout_ns = 20 * ns_per_ms;
  static constexpr uint64_t fine_step_ns = 200 * ns_per_us;  // while an answer is awaited
  static constexpr uint64_t open_timeout_ns = 1'500 * ns_per_ms;
  static constexpr uint64_t silence_timeout_ns = 1'000 * ns_per_ms;

  void receive() {
    std::array<uint8_t, 512> block{};
    const uint64_t now_us = clock_.now_ns() / ns_per_us;
    for (size_t count = line_->read(block); count > 0; count = line_->read(block)) {
      for (size_t i = 0; i < count; ++i)
        if (const auto message = link_.receive(block[i], now_us)) hooks_.received(*message);
    }
  }
  void keep_alive() {
    if (!greeted_) return;
    const uint64_t now_ns = clock_.now_ns();
    const uint64_t heard_ns = link_.last_heard_us() * ns_per_us;
    if (now_ns > heard_ns + silence_timeout_ns) return hooks_.broke("the controller has fallen silent");
    if (now_ns >= next_heartbeat_ns_) {
      send(wire::Heartbeat{.lease_id = lease_id_});
      next_heartbeat_ns_ = now_ns + heartbeat_interval_ns;
    }
    if (time_asked_ns_ != 0 && now_ns > time_asked_ns_ + time_answer_timeout_ns) time_asked_ns_ = 0;
    if (now_ns >= next_time_question_ns_) ask_time();
    hooks_.serviced();
  }
  void ask_time() {
    time_asked_ns_ = clock_.now_ns();
    next_time_question_ns_ = time_asked_ns_ + time_question_interval_ns;
    send(wire::TimeSyncRequest{.token = ++time_token_});
  }

  Clock& clock_;
  Hooks hooks_;
  std::unique_ptr<ByteLine> line_;
  wire::ReliableLink link_{wire::ReliableLink::Role::host};
  uint16_t session_ = 0;
  uint32_t lease_id_ = 0;
  bool greeted_ = false;
  uint64_t next_heartbeat_ns_ = 0;
  uint64_t next_time_question_ns_ = 0;
  uint32_t time_token_ = 0;
  uint64_t time_asked_ns_ = 0;  // 0: no question open
};

}  // namespace diastole
