// Arbitrary bytes against everything that reads bytes from the line: the frame decoder, both ends of the link
// and every message. What is accepted must encode to the very bytes it came from.

#include <algorithm>
#include <cstdlib>

#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace {

using namespace diastole::wire;

void must(bool holds) {
  if (!holds) std::abort();
}

void check_payload(std::uint8_t type, std::span<const std::uint8_t> payload) {
  visit_message(type, payload,
                overloaded{[&](const auto& message) {
                             std::array<std::uint8_t, kMaxPayloadBytes> memory{};
                             must(std::ranges::equal(encode(message, memory), payload));
                           },
                           [](const Undecodable& what) {
                             must(!what.known || what.fault.problem != DecodeProblem::none);
                           }});
}

void check_frame_round_trip(std::span<const std::uint8_t> payload) {
  std::array<std::uint8_t, kMaxEncodedBytes> encoded{};
  FrameDecoder decoder;
  std::size_t frames = 0;
  for (const std::uint8_t byte : encode_frame({0x1234, FrameKind::sequenced, 1, 2, 3}, payload, encoded)) {
    const auto outcome = decoder.push(byte);
    if (!outcome) continue;
    must(outcome->ok() && std::ranges::equal((*outcome)->payload, payload));
    ++frames;
  }
  must(frames == 1);
}

/// Feeds the bytes as the payload of intact frames too, so that the fuzzer gets past the CRC.
void feed_as_frame(ReliableLink& link, std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kHeaderBytes) return;
  const FrameHeader header{
      bytes[0], static_cast<FrameKind>(bytes[2] % 8), bytes[3], bytes[4], bytes[5],
  };
  const auto payload = bytes.subspan(kHeaderBytes);
  std::array<std::uint8_t, kMaxEncodedBytes> encoded{};
  for (const std::uint8_t byte :
       encode_frame(header, payload.first(std::min(payload.size(), kMaxPayloadBytes)), encoded))
    if (const auto received = link.receive(byte, 0)) check_payload(received->type, received->payload);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  if (size > 0) check_payload(data[0], bytes.subspan(1));
  if (size <= kMaxPayloadBytes) check_frame_round_trip(bytes);
  for (const auto role : {ReliableLink::Role::host, ReliableLink::Role::controller}) {
    ReliableLink link(role);
    if (role == ReliableLink::Role::host) link.open(7, 0);
    std::uint64_t now_us = 0;
    for (std::size_t at = 0; at < size; at += 16) {
      const auto chunk = bytes.subspan(at, std::min<std::size_t>(16, size - at));
      for (const std::uint8_t byte : chunk)
        if (const auto received = link.receive(byte, now_us))
          check_payload(received->type, received->payload);
      feed_as_frame(link, chunk);
      (void)link.send(MessageType::Trigger, chunk);
      now_us += 30'000;
      for (int frame = 0; frame < 32 && !link.transmit(now_us).empty(); ++frame) {
      }
    }
  }
  return 0;
}
