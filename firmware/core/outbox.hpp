#pragma once
// Messages that wait for room in the link's window: answers and events, first in, first out.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/core/ring.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::firmware {

class Outbox {
 public:
  static constexpr std::size_t kSlots = 32;
  static constexpr std::size_t kMaxBytes = 80;

  /// False when full: the host does not take its answers.
  template <class Message>
  bool put(const Message& message) {
    Letter letter{Message::kType, 0, {}};
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    const auto bytes = wire::encode(message, payload);
    static_assert(sizeof(Message) <= kMaxBytes + 16, "a message of this size needs a path of its own");
    std::copy(bytes.begin(), bytes.end(), letter.bytes.begin());
    letter.size = static_cast<std::uint8_t>(bytes.size());
    if (letters_.push(letter)) return true;
    ++lost_;
    return false;
  }
  [[nodiscard]] std::size_t room() const { return kSlots - letters_.size(); }
  /// Messages that found the outbox full since reset.
  [[nodiscard]] std::uint32_t lost() const { return lost_; }
  [[nodiscard]] bool empty() const { return letters_.size() == 0; }

  /// Hands over as many as the window takes.
  void flush(wire::ReliableLink& link) {
    for (const Letter* letter = letters_.front(); letter != nullptr; letter = letters_.front()) {
      if (!link.send(letter->type, std::span(letter->bytes).first(letter->size))) return;
      letters_.pop();
    }
  }

 private:
  struct Letter {
    wire::MessageType type{};
    std::uint8_t size = 0;
    std::array<std::uint8_t, kMaxBytes> bytes{};
  };
  Ring<Letter, kSlots> letters_;
  std::uint32_t lost_ = 0;
};

}  // namespace diastole::firmware
