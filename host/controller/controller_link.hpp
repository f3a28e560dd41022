#pragma once
// One session with the controller over its serial line: bytes to messages and back, and once it is greeted the
// heartbeat that keeps the lease, the questions of time that the clock map rests on, and the watch for silence.

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

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

  ControllerLink(Clock& clock, Hooks hooks);

  /// Begins a session on this line; false, and closed again, if nobody answers in time.
  bool open(std::unique_ptr<ByteLine> line);
  void close();
  [[nodiscard]] bool has_line() const { return line_ != nullptr; }
  [[nodiscard]] ByteLine* line() { return line_.get(); }

  /// The controller has introduced itself: from now on it is kept alive. The first order may follow at once.
  void greeted();
  /// The next service() sends a heartbeat.
  void beat_at_once() { next_heartbeat_ns_ = clock_.now_ns(); }
  [[nodiscard]] uint32_t lease_id() const { return lease_id_; }
  /// The two clocks' reading that this answer completes, if it is the last question's.
  std::optional<ClockReading> take(const wire::TimeSync& sync);

  template <class Message>
  void send(const Message& message) {
    std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
    (void)link_.send(Message::kType, wire::encode(message, memory));
  }
  void transmit();
  /// Takes in what arrived and sends what is due.
  void service();
  /// The same before and after a short sleep.
  void turn();
  /// When service() has something to send next.
  [[nodiscard]] uint64_t next_due_ns() const;

 private:
  void receive();
  void keep_alive();
  void ask_time();

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
