#pragma once
// Message numbers and how each is delivered, from message_list.inc.

#include <cstdint>

namespace diastole::wire {

enum class MessageType : std::uint8_t {
#define DIASTOLE_MESSAGE(number, name, sender, delivery) name = number,
#include "protocol/wire/message_list.inc"
};

enum class Sender : std::uint8_t { host, controller };
enum class Delivery : std::uint8_t { datagram, sequenced };

constexpr Delivery delivery_of(MessageType type) {
  switch (type) {
#define DIASTOLE_MESSAGE(number, name, sender, delivery) \
  case MessageType::name:                                \
    return Delivery::delivery;
#include "protocol/wire/message_list.inc"
  }
  return Delivery::sequenced;
}

/// Requests of an update (update_messages.hpp).
constexpr bool is_update(MessageType type) { return (static_cast<std::uint8_t>(type) & 0xF0U) == 0x30; }

/// Those of them that only a bootloader carries out.
constexpr bool for_bootloader(MessageType type) {
  return is_update(type) && type >= MessageType::BeginUpdate;
}

constexpr Sender sender_of(MessageType type) {
  switch (type) {
#define DIASTOLE_MESSAGE(number, name, sender, delivery) \
  case MessageType::name:                                \
    return Sender::sender;
#include "protocol/wire/message_list.inc"
  }
  return Sender::host;
}

}  // namespace diastole::wire
