#pragma once
// Bytes ↔ messages, for every message of message_list.inc.
//
//   std::array<std::uint8_t, kMaxPayloadBytes> memory;
//   link.send(Heartbeat::kType, encode(Heartbeat{lease_id}, memory));
//
//   visit_message(received.type, received.payload, overloaded{
//     [&](const Trigger& trigger) { ... },
//     [&](const auto&) {},                                   // messages that do not concern us
//     [&](const Undecodable& what) { ... }});                // unknown type, wrong length, value out of
//     range

#include <cstdint>
#include <span>

#include "protocol/wire/black_box_messages.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/frame.hpp"
#include "protocol/wire/motion_messages.hpp"
#include "protocol/wire/program_messages.hpp"
#include "protocol/wire/result.hpp"
#include "protocol/wire/self_test_messages.hpp"
#include "protocol/wire/session_messages.hpp"
#include "protocol/wire/settings_messages.hpp"
#include "protocol/wire/status_messages.hpp"
#include "protocol/wire/telemetry_messages.hpp"
#include "protocol/wire/update_messages.hpp"

namespace diastole::wire {

/// Writes the message into `out` (at least kMaxPayloadBytes long) and returns the bytes used.
template <class Message>
constexpr std::span<const std::uint8_t> encode(const Message& message, std::span<std::uint8_t> out) {
  FieldWriter writer(out);
  Message::layout(message, writer);
  return out.first(writer.size());
}

/// Reads a payload; refuses any other length than the message's own and any field out of its range.
template <class Message>
constexpr Result<Message, DecodeFault> decode(std::span<const std::uint8_t> payload) {
  Message message;
  FieldReader reader(payload);
  Message::layout(message, reader);
  if (reader.fault().problem != DecodeProblem::none) return reader.fault();
  return message;
}

namespace detail {
consteval std::uint32_t schema_hash() {
  SchemaHasher hash;
#define DIASTOLE_MESSAGE(number_, name, sender, delivery) \
  hash.number(number_);                                   \
  hash.text(#name " " #sender " " #delivery);             \
  {                                                       \
    const name message;                                   \
    name::layout(message, hash);                          \
  }
#include "protocol/wire/message_list.inc"
  return hash.value();
}
}  // namespace detail

/// Equal on both sides, or host and firmware do not belong together.
inline constexpr std::uint32_t kSchemaHash = detail::schema_hash();

/// A payload that is no valid message: `known` if the type is, and its payload bad.
struct Undecodable {
  std::uint8_t type = 0;
  bool known = false;
  DecodeFault fault;
};

namespace detail {
template <bool (*wanted)(MessageType), class Handler>
constexpr void visit(std::uint8_t type, std::span<const std::uint8_t> payload, Handler&& handler) {
  switch (static_cast<MessageType>(type)) {
#define DIASTOLE_MESSAGE(number, name, sender, delivery)   \
  case MessageType::name:                                  \
    if constexpr (wanted(MessageType::name)) {             \
      const auto message = decode<name>(payload);          \
      if (message.ok())                                    \
        handler(message.value());                          \
      else                                                 \
        handler(Undecodable{type, true, message.error()}); \
      return;                                              \
    }                                                      \
    break;
#include "protocol/wire/message_list.inc"
  }
  handler(Undecodable{type, false, {}});
}
constexpr bool any(MessageType) { return true; }
constexpr bool for_application(MessageType type) {
  return sender_of(type) == Sender::host && !for_bootloader(type);
}
}  // namespace detail

/// Decodes and calls `handler` with the message, or with Undecodable.
template <class Handler>
constexpr void visit_message(std::uint8_t type, std::span<const std::uint8_t> payload, Handler&& handler) {
  detail::visit<detail::any>(type, payload, handler);
}

/// As visit_message, for a controller's application: only what a host asks of it is decoded, anything else is an
/// unknown Undecodable. An image carries no more than it needs.
template <class Handler>
constexpr void visit_request(std::uint8_t type, std::span<const std::uint8_t> payload, Handler&& handler) {
  detail::visit<detail::for_application>(type, payload, handler);
}

/// Lambdas as one handler for visit_message.
template <class... Lambdas>
struct overloaded : Lambdas... {
  using Lambdas::operator()...;
};
template <class... Lambdas>
overloaded(Lambdas...) -> overloaded<Lambdas...>;

}  // namespace diastole::wire
