#pragma once
// One end of the line: every sequenced message arrives exactly once, in order and unaltered, or the link is
// reported as lost; datagrams arrive at most once. No I/O: bytes and the time are arguments, all memory is
// inside the object (about 3.5 KB).
//
//   host: link.open(session, now_us);                     // any number it did not use last time
//   every turn, both sides:
//     for (byte : serial.read()) if (auto message = link.receive(byte, now_us)) handle(*message);
//     while (serial.room() >= kMaxEncodedBytes) { auto bytes = link.transmit(now_us); if empty: break; write
//     }
//
// Sessions. The host opens one with a number of its choice; both sides count from 0. `open` with the number
// already open changes nothing (it is a repetition). A controller that was reset, or has been opened by
// another host, answers frames of any other session with `closed`, whereupon the host's state becomes `lost`:
// what was not acknowledged then may or may not have arrived, and the host opens a new session and asks.
//
// Numbers. Go-back-N: up to kWindow frames in flight, acknowledged cumulatively by the `ack` of any frame;
// repeated from the first unacknowledged one when retransmit_us pass without progress, or at once (at most
// once per gap) when a bare ack repeats itself. Numbers are 8 bits: a frame delayed by 248 or more others
// would be taken for a new one; a serial line does not reorder.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/frame.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

struct LinkCounters {
  std::uint32_t frames_received = 0;  ///< intact ones
  std::uint32_t frames_sent = 0;
  std::uint32_t crc_errors = 0;
  std::uint32_t framing_errors = 0;  ///< truncated, too long, of unknown kind
  std::uint32_t duplicates = 0;
  std::uint32_t out_of_order = 0;
  std::uint32_t retransmissions = 0;
  std::uint32_t wrong_session = 0;
  std::uint32_t datagrams_dropped = 0;  ///< the line was too slow for them
};

/// `payload` lives until the next call of receive().
struct Received {
  std::uint8_t type = 0;
  Delivery delivery = Delivery::sequenced;
  std::span<const std::uint8_t> payload;
};

class ReliableLink {
 public:
  enum class Role : std::uint8_t { host, controller };
  enum class State : std::uint8_t { closed, opening, open, lost };
  struct Options {
    std::uint64_t retransmit_us = 60'000;
    std::uint64_t reopen_us = 50'000;
  };
  static constexpr std::size_t kWindow = 8;
  static constexpr std::size_t kDatagramSlots = 4;
  static constexpr std::size_t kMaxDatagramBytes = 32;

  explicit ReliableLink(Role role) : ReliableLink(role, Options{}) {}
  ReliableLink(Role role, Options options) : role_(role), options_(options) {}

  /// Host only: begins a session; everything unsent or unacknowledged is forgotten.
  void open(std::uint16_t session, std::uint64_t now_us);
  void close();

  /// Queues a message. False: not open, window full (try again after the next acknowledgement), or payload
  /// too long. Datagrams never fail while the link is open: the oldest waiting one gives way.
  [[nodiscard]] bool send(MessageType type, std::span<const std::uint8_t> payload);
  /// Sequenced messages that send() would accept now.
  [[nodiscard]] std::size_t room() const { return state_ == State::open ? kWindow - queued_ : 0; }
  /// True when every sequenced message has been acknowledged.
  [[nodiscard]] bool idle() const { return queued_ == 0; }

  /// Takes one byte from the line; returns a message when this byte completes one.
  std::optional<Received> receive(std::uint8_t byte, std::uint64_t now_us);
  /// The next encoded frame for the line, empty when there is none; lives until the next call.
  std::span<const std::uint8_t> transmit(std::uint64_t now_us);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] std::uint16_t session() const { return session_; }
  /// Sessions opened so far: a change shows the controller that its peer has begun anew.
  [[nodiscard]] std::uint32_t generation() const { return generation_; }
  /// When the last intact frame of this session came.
  [[nodiscard]] std::uint64_t last_heard_us() const { return last_heard_us_; }
  [[nodiscard]] const LinkCounters& counters() const { return counters_; }

 private:
  struct Slot {
    std::uint8_t type = 0;
    std::uint8_t size = 0;
    std::array<std::uint8_t, kMaxPayloadBytes> payload{};
  };
  struct Datagram {
    std::uint8_t type = 0;
    std::uint8_t size = 0;
    std::array<std::uint8_t, kMaxDatagramBytes> payload{};
  };

  std::optional<Received> accept(const Frame& frame, std::uint64_t now_us);
  bool accept_session(const FrameHeader& header, std::uint64_t now_us);
  void accept_ack(const FrameHeader& header, std::uint64_t now_us);
  void begin_session(std::uint16_t session, State state);
  void go_back(std::uint64_t now_us);
  bool queue_datagram(MessageType type, std::span<const std::uint8_t> payload);
  std::span<const std::uint8_t> emit(FrameKind kind, std::uint16_t session, std::uint8_t type,
                                     std::uint8_t seq, std::span<const std::uint8_t> payload);
  std::span<const std::uint8_t> emit_control(std::uint64_t now_us);
  std::span<const std::uint8_t> emit_sequenced(std::uint64_t now_us);

  Role role_;
  Options options_;
  State state_ = State::closed;
  std::uint16_t session_ = 0;
  std::uint32_t generation_ = 0;
  std::uint64_t last_heard_us_ = 0;
  LinkCounters counters_;
  FrameDecoder decoder_;
  std::array<std::uint8_t, kMaxEncodedBytes> encoded_{};

  // Sending: slots base_ … base_ + queued_ - 1 hold messages; the first sent_ of them are on the line, the
  // first ever_sent_ have been there at least once.
  std::array<Slot, kWindow> slots_{};
  std::uint8_t base_ = 0;
  std::size_t queued_ = 0;
  std::size_t sent_ = 0;
  std::size_t ever_sent_ = 0;
  std::uint64_t progress_us_ = 0;
  bool gap_repaired_ = false;

  std::array<Datagram, kDatagramSlots> datagrams_{};
  std::size_t first_datagram_ = 0;
  std::size_t waiting_datagrams_ = 0;

  // Receiving.
  std::uint8_t expected_ = 0;
  bool ack_due_ = false;
  bool open_ack_due_ = false;
  std::optional<std::uint16_t> closed_due_;
  std::uint64_t next_open_us_ = 0;
};

}  // namespace diastole::wire
