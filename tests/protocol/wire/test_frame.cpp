#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "protocol/wire/frame.hpp"

namespace diastole::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes encoded(const FrameHeader& header, const Bytes& payload) {
  std::array<std::uint8_t, kMaxEncodedBytes> out{};
  const auto bytes = encode_frame(header, payload, out);
  return {bytes.begin(), bytes.end()};
}

struct Outcomes {
  std::vector<Bytes> payloads;
  std::vector<FrameHeader> headers;
  std::vector<FrameFault> faults;
};

Outcomes decode_all(const Bytes& bytes) {
  Outcomes outcomes;
  FrameDecoder decoder;
  for (const std::uint8_t byte : bytes) {
    const auto outcome = decoder.push(byte);
    if (!outcome) continue;
    if (outcome->ok()) {
      outcomes.payloads.emplace_back((*outcome)->payload.begin(), (*outcome)->payload.end());
      outcomes.headers.push_back((*outcome)->header);
    } else {
      outcomes.faults.push_back(outcome->error());
    }
  }
  return outcomes;
}

Bytes random_payload(std::mt19937& random, std::size_t size) {
  Bytes payload(size);
  // Half of the bytes are 0x00 or 0xFF, where byte stuffing goes wrong if it does.
  for (auto& byte : payload) {
    const auto draw = random();
    byte = static_cast<std::uint8_t>((draw & 3U) == 0 ? 0x00 : (draw & 3U) == 1 ? 0xFF : draw >> 8);
  }
  return payload;
}

TEST(Frame, IsEncodedAsDrawnInTheHeader) {
  EXPECT_EQ(encoded({0x1234, FrameKind::datagram, 0x02, 0, 3}, {0x07, 0x00}),
            (Bytes{0x05, 0x34, 0x12, 0x04, 0x02, 0x03, 0x03, 0x07, 0x05, 0xE1, 0x36, 0xB2, 0x38, 0x00}));
}

TEST(Frame, EveryPayloadLengthSurvivesTheRoundTrip) {
  std::mt19937 random(1);
  for (std::size_t size = 0; size <= kMaxPayloadBytes; ++size) {
    for (const Bytes& payload :
         {random_payload(random, size), Bytes(size, 0), Bytes(size, 0xFF), Bytes(size, 1)}) {
      const Bytes line = encoded({0xBEEF, FrameKind::sequenced, 9, 200, 0}, payload);
      EXPECT_EQ(std::count(line.begin(), line.end(), 0), 1);
      EXPECT_LE(line.size(), kMaxEncodedBytes);
      const Outcomes outcomes = decode_all(line);
      ASSERT_EQ(outcomes.payloads.size(), 1U) << size;
      EXPECT_EQ(outcomes.payloads[0], payload);
      EXPECT_EQ(outcomes.headers[0].session, 0xBEEF);
      EXPECT_EQ(outcomes.headers[0].kind, FrameKind::sequenced);
      EXPECT_EQ(outcomes.headers[0].type, 9);
      EXPECT_EQ(outcomes.headers[0].seq, 200);
      EXPECT_TRUE(outcomes.faults.empty());
    }
  }
}

TEST(Frame, EveryPrefixIsRefusedAndTheNextFrameIsReadAgain) {
  std::mt19937 random(2);
  const Bytes good = encoded({7, FrameKind::datagram, 3, 0, 0}, {1, 2, 3});
  for (const std::size_t size : {0U, 1U, 40U, 244U}) {
    const Bytes whole = encoded({7, FrameKind::sequenced, 1, 0, 0}, random_payload(random, size));
    for (std::size_t kept = 1; kept + 1 < whole.size(); ++kept) {
      Bytes line(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(kept));
      line.push_back(0);
      line.insert(line.end(), good.begin(), good.end());
      const Outcomes outcomes = decode_all(line);
      ASSERT_EQ(outcomes.payloads.size(), 1U) << "prefix of " << kept;
      EXPECT_EQ(outcomes.payloads[0], (Bytes{1, 2, 3}));
      EXPECT_EQ(outcomes.faults.size(), 1U);
    }
  }
}

TEST(Frame, ATruncatedFrameCostsAtMostTheOneThatFollows) {
  const Bytes first = encoded({7, FrameKind::datagram, 3, 0, 0}, {9, 9, 9, 9});
  const Bytes good = encoded({7, FrameKind::datagram, 3, 0, 0}, {1, 2, 3});
  for (std::size_t kept = 0; kept < first.size(); ++kept) {
    Bytes line(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(kept));
    for (int i = 0; i < 2; ++i)
      line.insert(line.end(), good.begin(), good.end());
    const Outcomes outcomes = decode_all(line);
    ASSERT_FALSE(outcomes.payloads.empty());
    for (const Bytes& payload : outcomes.payloads)
      EXPECT_EQ(payload, (Bytes{1, 2, 3}));
  }
}

TEST(Frame, EverySingleBitErrorIsRefused) {
  const Bytes whole = encoded({7, FrameKind::sequenced, 1, 5, 6}, {1, 0, 3, 0, 0, 255});
  for (std::size_t bit = 0; bit < (whole.size() - 1) * 8; ++bit) {
    Bytes line = whole;
    line[bit / 8] = static_cast<std::uint8_t>(line[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_TRUE(decode_all(line).payloads.empty()) << "bit " << bit;
  }
}

TEST(Frame, TooLongIsSaidSo) {
  Bytes line(600, 0x55);
  line.push_back(0);
  EXPECT_THAT(decode_all(line).faults, testing::ElementsAre(FrameFault::too_long));
}

TEST(Frame, UnknownKindIsSaidSo) {
  EXPECT_THAT(decode_all(encoded({7, static_cast<FrameKind>(6), 0, 0, 0}, {})).faults,
              testing::ElementsAre(FrameFault::bad_kind));
}

TEST(Frame, RandomBytesNeverMakeAFrame) {
  std::mt19937 random(3);
  Bytes noise(400'000);
  for (auto& byte : noise)
    byte = static_cast<std::uint8_t>((random() & 15U) == 0 ? 0U : random());
  const Outcomes outcomes = decode_all(noise);
  EXPECT_TRUE(outcomes.payloads.empty());
  EXPECT_GT(outcomes.faults.size(), 10'000U);
}

}  // namespace
}  // namespace diastole::wire
