#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <vector>

#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// One direction of a bad line: whole encoded frames are lost, repeated or overtaken, single bits flipped.
struct Channel {
  double loss = 0, repetition = 0, reordering = 0, bit_error = 0;
  std::deque<Bytes> flying;

  void put(std::span<const std::uint8_t> bytes, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    if (unit(random) < loss) return;
    const int copies = unit(random) < repetition ? 2 : 1;
    for (int copy = 0; copy < copies; ++copy) {
      Bytes frame(bytes.begin(), bytes.end());
      if (bit_error > 0) {
        std::geometric_distribution<std::size_t> gap(bit_error);
        for (std::size_t bit = gap(random); bit < frame.size() * 8; bit += 1 + gap(random))
          frame[bit / 8] = static_cast<std::uint8_t>(frame[bit / 8] ^ (1U << (bit % 8)));
      }
      if (!flying.empty() && unit(random) < reordering)
        flying.insert(flying.end() - 1, frame);
      else
        flying.push_back(frame);
    }
  }
};

struct Pair {
  ReliableLink host{ReliableLink::Role::host};
  ReliableLink controller{ReliableLink::Role::controller};
  Channel down, up;
  std::mt19937 random;
  std::uint64_t now_us = 1'000'000;

  explicit Pair(unsigned seed) : random(seed) {}

  /// One millisecond: each side sends what it may and reads at most two frames.
  template <class AtController, class AtHost>
  void turn(AtController at_controller, AtHost at_host) {
    now_us += 1000;
    send_all(host, down);
    send_all(controller, up);
    read(down, controller, at_controller);
    read(up, host, at_host);
  }
  void send_all(ReliableLink& link, Channel& channel) {
    for (auto bytes = link.transmit(now_us); !bytes.empty(); bytes = link.transmit(now_us))
      channel.put(bytes, random);
  }
  template <class Sink>
  void read(Channel& channel, ReliableLink& link, Sink sink) {
    for (int frame = 0; frame < 2 && !channel.flying.empty(); ++frame) {
      for (const std::uint8_t byte : channel.flying.front())
        if (const auto received = link.receive(byte, now_us)) sink(*received);
      channel.flying.pop_front();
    }
  }
  void settle() {
    for (int i = 0; i < 200; ++i)
      turn([](const Received&) {}, [](const Received&) {});
  }
};

Bytes numbered(std::uint32_t number, std::size_t size) {
  Bytes payload(4 + size % 200);
  for (std::size_t i = 0; i < payload.size(); ++i)
    payload[i] = static_cast<std::uint8_t>(i < 4 ? number >> (8 * i) : number * 31 + i);
  return payload;
}

/// Sends `total` messages each way and expects each of them once, in order, unaltered.
void exchange(Pair& pair, std::uint32_t total, int most_turns) {
  std::uint32_t sent_down = 0, sent_up = 0, got_down = 0, got_up = 0;
  const auto expect = [](std::uint32_t& next) {
    return [&next](const Received& received) {
      ASSERT_EQ(received.delivery, Delivery::sequenced);
      ASSERT_EQ(Bytes(received.payload.begin(), received.payload.end()), numbered(next, next * 7));
      ++next;
    };
  };
  pair.host.open(0x51, pair.now_us);
  for (int turn = 0; turn < most_turns && (got_down < total || got_up < total); ++turn) {
    while (sent_down < total && pair.host.send(MessageType::AddSegment, numbered(sent_down, sent_down * 7)))
      ++sent_down;
    while (sent_up < total &&
           pair.controller.send(MessageType::PositionBatch, numbered(sent_up, sent_up * 7)))
      ++sent_up;
    pair.turn(expect(got_down), expect(got_up));
    ASSERT_FALSE(testing::Test::HasFatalFailure());
  }
  EXPECT_EQ(got_down, total);
  EXPECT_EQ(got_up, total);
}

TEST(ReliableLink, CleanLineCarriesEverythingWithoutRepetition) {
  Pair pair(1);
  exchange(pair, 2000, 100'000);
  EXPECT_EQ(pair.host.counters().retransmissions, 0U);
  EXPECT_EQ(pair.controller.counters().retransmissions, 0U);
  EXPECT_EQ(pair.host.counters().duplicates, 0U);
}

struct Trouble {
  double loss, repetition, reordering, bit_error;
};
class BadLine : public testing::TestWithParam<Trouble> {};

TEST_P(BadLine, DeliversEverythingExactlyOnceInOrder) {
  const Trouble trouble = GetParam();
  std::uint32_t errors = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Pair pair(seed);
    for (Channel* channel : {&pair.down, &pair.up})
      *channel = {trouble.loss, trouble.repetition, trouble.reordering, trouble.bit_error, {}};
    exchange(pair, 300, 400'000);
    if (HasFailure()) FAIL() << "seed " << seed;
    errors += pair.host.counters().crc_errors + pair.controller.counters().crc_errors;
  }
  if (trouble.bit_error > 0) {
    EXPECT_GT(errors, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(Lines, BadLine,
                         testing::Values(Trouble{0.2, 0, 0, 0}, Trouble{0, 0.3, 0, 0}, Trouble{0, 0, 0.3, 0},
                                         Trouble{0, 0, 0, 1e-5}, Trouble{0, 0, 0, 1e-3},
                                         Trouble{0.1, 0.1, 0.1, 1e-4}, Trouble{0.5, 0.2, 0.2, 0}));

TEST(ReliableLink, AFrozenPeerStopsTheSenderAtTheWindow) {
  Pair pair(2);
  pair.host.open(1, pair.now_us);
  pair.settle();
  ASSERT_EQ(pair.host.state(), ReliableLink::State::open);
  std::size_t accepted = 0;
  while (pair.host.send(MessageType::StopNow, numbered(0, 0)))
    ++accepted;
  EXPECT_EQ(accepted, ReliableLink::kWindow);
  EXPECT_EQ(pair.host.room(), 0U);
  pair.settle();
  EXPECT_TRUE(pair.host.idle());
}

TEST(ReliableLink, NothingIsSentBeforeTheSessionIsOpen) {
  ReliableLink controller(ReliableLink::Role::controller);
  EXPECT_FALSE(controller.send(MessageType::Trigger, {}));
  EXPECT_FALSE(controller.send(MessageType::TimeSync, {}));
  EXPECT_TRUE(controller.transmit(0).empty());
}

TEST(ReliableLink, AResetControllerIsNoticedAtTheNextFrameAndANewSessionIsClean) {
  Pair pair(3);
  pair.host.open(10, pair.now_us);
  pair.settle();
  ASSERT_TRUE(pair.host.send(MessageType::StatusRequest, numbered(1, 0)));
  pair.settle();
  pair.controller = ReliableLink(ReliableLink::Role::controller);
  ASSERT_TRUE(pair.host.send(MessageType::Heartbeat, numbered(2, 0)));
  pair.turn([](const Received&) { FAIL() << "executed a message of a forgotten session"; },
            [](const Received&) {});
  pair.settle();
  EXPECT_EQ(pair.host.state(), ReliableLink::State::lost);
  exchange(pair, 50, 10'000);
}

TEST(ReliableLink, ASecondHostSessionForgetsTheFirst) {
  Pair pair(4);
  pair.host.open(10, pair.now_us);
  pair.settle();
  ASSERT_TRUE(pair.controller.send(MessageType::Trigger, numbered(1, 0)));
  const auto before = pair.controller.generation();
  pair.host.open(11, pair.now_us);
  pair.turn([](const Received&) {}, [](const Received&) {});
  EXPECT_NE(pair.controller.generation(), before);
  EXPECT_EQ(pair.controller.session(), 11);
  EXPECT_TRUE(pair.controller.idle());
}

TEST(ReliableLink, ARepeatedOpenChangesNothing) {
  Pair pair(5);
  pair.down.repetition = 1;
  exchange(pair, 40, 10'000);
  EXPECT_EQ(pair.controller.generation(), 1U);
}

TEST(ReliableLink, DatagramsAreNeverRepeatedAndTheOldestGivesWay) {
  Pair pair(6);
  pair.host.open(1, pair.now_us);
  pair.settle();
  for (std::uint32_t i = 0; i < 6; ++i)
    EXPECT_TRUE(pair.host.send(MessageType::Heartbeat, numbered(i, 0)));
  std::vector<std::uint8_t> seen;
  for (int i = 0; i < 300; ++i)
    pair.turn([&](const Received& received) { seen.push_back(received.payload[0]); }, [](const Received&) {});
  EXPECT_EQ(seen, (std::vector<std::uint8_t>{2, 3, 4, 5}));
  EXPECT_EQ(pair.host.counters().datagrams_dropped, 2U);
}

TEST(ReliableLink, RandomBytesAreNeverDelivered) {
  std::mt19937 random(7);
  ReliableLink controller(ReliableLink::Role::controller);
  for (int i = 0; i < 400'000; ++i)
    ASSERT_FALSE(controller.receive(static_cast<std::uint8_t>((random() & 15U) == 0 ? 0U : random()), 0));
  EXPECT_EQ(controller.state(), ReliableLink::State::closed);
}

}  // namespace
}  // namespace diastole::wire
