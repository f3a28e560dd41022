// Every message cut off after every byte, or begun at every byte: the receiver takes nothing of it and is in step
// again with the next frame or, when the cut took the end with it, the one after.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Role = ReliableLink::Role;

struct Example {
  std::string name;
  MessageType type;
  Bytes payload;
};

std::vector<Example> examples() {
  std::vector<Example> all;
#define DIASTOLE_MESSAGE(number, name, sender, delivery)                          \
  {                                                                               \
    std::array<std::uint8_t, kMaxPayloadBytes> memory{};                          \
    const auto bytes = encode(name::example(), memory);                           \
    all.push_back({#name, MessageType::name, Bytes(bytes.begin(), bytes.end())}); \
  }
#include "protocol/wire/message_list.inc"
  return all;
}

constexpr std::uint16_t kSession = 0x51;

Bytes frame(const Example& message, FrameKind kind, std::uint8_t seq, std::uint8_t ack) {
  std::array<std::uint8_t, kMaxEncodedBytes> memory{};
  const auto bytes = encode_frame({kSession, kind, static_cast<std::uint8_t>(message.type), seq, ack},
                                  message.payload, memory);
  return {bytes.begin(), bytes.end()};
}

FrameKind kind_of(const Example& message) {
  return delivery_of(message.type) == Delivery::datagram ? FrameKind::datagram : FrameKind::sequenced;
}

/// An end of the line that has just opened the session.
ReliableLink open_link(Role role) {
  ReliableLink link(role);
  if (role == Role::host) link.open(kSession, 0);
  std::array<std::uint8_t, kMaxEncodedBytes> memory{};
  const FrameKind greeting = role == Role::host ? FrameKind::open_ack : FrameKind::open;
  for (const std::uint8_t byte : encode_frame({kSession, greeting, 0, 0, 0}, {}, memory))
    (void)link.receive(byte, 0);
  return link;
}

/// Payloads of the messages that `link` takes from `bytes`.
std::vector<Bytes> payloads(ReliableLink& link, const Bytes& bytes) {
  std::vector<Bytes> found;
  for (const std::uint8_t byte : bytes)
    if (const auto received = link.receive(byte, 0))
      found.emplace_back(received->payload.begin(), received->payload.end());
  return found;
}

class CutFrames : public testing::TestWithParam<Role> {};

TEST_P(CutFrames, APrefixIsNotTakenAndCostsAtMostTheNextFrame) {
  const Example marker{"marker", MessageType::StatusRequest, {0x34, 0x12}};
  for (const Example& message : examples()) {
    const Bytes whole = frame(message, kind_of(message), 0, 0);
    for (std::size_t cut = 0; cut < whole.size(); ++cut) {
      ReliableLink link = open_link(GetParam());
      const Bytes prefix(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut));
      ASSERT_TRUE(payloads(link, prefix).empty()) << message.name << " cut at " << cut;
      // The same frame twice: the first may grow together with what is left of the cut one.
      const Bytes next = frame(marker, FrameKind::sequenced, 0, 0);
      std::size_t found = payloads(link, next).size();
      ASSERT_GE(found, cut == 0 ? 1U : 0U) << message.name;
      found += payloads(link, next).size();
      ASSERT_EQ(found, 1U) << message.name << " cut at " << cut;
      ASSERT_EQ(link.state(), ReliableLink::State::open);
    }
  }
}

TEST_P(CutFrames, AFrameWithoutItsBeginningCostsNoOther) {
  const Example marker{"marker", MessageType::StatusRequest, {0x34, 0x12}};
  for (const Example& message : examples()) {
    const Bytes whole = frame(message, kind_of(message), 0, 0);
    for (std::size_t cut = 1; cut < whole.size(); ++cut) {
      ReliableLink link = open_link(GetParam());
      const Bytes rest(whole.begin() + static_cast<std::ptrdiff_t>(cut), whole.end());
      ASSERT_TRUE(payloads(link, rest).empty()) << message.name << " from " << cut;
      ASSERT_EQ(payloads(link, frame(marker, FrameKind::sequenced, 0, 0)).size(), 1U) << message.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BothEnds, CutFrames, testing::Values(Role::controller, Role::host),
                         [](const auto& role) { return role.param == Role::host ? "host" : "controller"; });

TEST(CutMessages, NoShorterOrLongerPayloadDecodes) {
  for (const Example& message : examples()) {
    const auto decodes = [&](const Bytes& payload) {
      bool good = true;
      visit_message(static_cast<std::uint8_t>(message.type), payload,
                    overloaded{[](const auto&) {}, [&](const Undecodable&) { good = false; }});
      return good;
    };
    ASSERT_TRUE(decodes(message.payload)) << message.name;
    for (std::size_t size = 0; size < message.payload.size(); ++size)
      EXPECT_FALSE(
          decodes({message.payload.begin(), message.payload.begin() + static_cast<std::ptrdiff_t>(size)}))
          << message.name << " of " << size;
    Bytes longer = message.payload;
    longer.push_back(0);
    EXPECT_FALSE(decodes(longer)) << message.name;
  }
}

}  // namespace
}  // namespace diastole::wire
