#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "protocol/wire/messages.hpp"

namespace diastole::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <class Message>
Bytes encoded(const Message& message) {
  std::array<std::uint8_t, kMaxPayloadBytes> out{};
  const auto bytes = encode(message, out);
  return {bytes.begin(), bytes.end()};
}

/// Every message header, with comment marks and line breaks made one blank.
std::string header_text() {
  std::string text;
  for (const char* name : {"session", "program", "motion", "status", "telemetry", "settings", "black_box",
                           "self_test", "update"}) {
    std::ifstream file(std::string(DIASTOLE_SOURCE_DIR "/protocol/wire/") + name + "_messages.hpp");
    text += std::string(std::istreambuf_iterator<char>(file), {});
  }
  std::istringstream words(text);
  std::string joined, word;
  while (words >> word)
    if (word != "//") joined += (joined.empty() ? "" : " ") + word;
  return joined;
}

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    char digits[4];
    std::snprintf(digits, sizeof digits, " %02X", byte);
    text += digits;
  }
  return text;
}

template <class Message>
class EveryMessage : public testing::Test {};

template <class... Messages>
testing::Types<Messages...> without_first(testing::Types<void, Messages...>);
using AllMessages = decltype(without_first(std::declval<testing::Types<void
#define DIASTOLE_MESSAGE(number, name, sender, delivery) , name
#include "protocol/wire/message_list.inc"
                                                                       >>()));
TYPED_TEST_SUITE(EveryMessage, AllMessages);

TYPED_TEST(EveryMessage, ExampleEncodesToTheBytesInItsHeader) {
  static const std::string headers = header_text();
  const std::string name = [] {
#define DIASTOLE_MESSAGE(number, name, sender, delivery) \
  if (TypeParam::kType == MessageType::name) return #name;
#include "protocol/wire/message_list.inc"
    return "";
  }();
  const std::string wanted = "Example " + name + ":" + hex(encoded(TypeParam::example()));
  EXPECT_TRUE(headers.find(wanted + " struct " + name) != std::string::npos ||
              headers.find(wanted + " using " + name) != std::string::npos)
      << wanted;
}

TYPED_TEST(EveryMessage, ExampleSurvivesTheRoundTrip) {
  const Bytes bytes = encoded(TypeParam::example());
  const auto message = decode<TypeParam>(bytes);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(encoded(*message), bytes);
}

TYPED_TEST(EveryMessage, EveryOtherLengthIsRefused) {
  const Bytes whole = encoded(TypeParam::example());
  for (std::size_t size = 0; size <= kMaxPayloadBytes; ++size) {
    if (size == whole.size()) continue;
    Bytes bytes = whole;
    bytes.resize(size, 0xA5);
    const auto message = decode<TypeParam>(bytes);
    ASSERT_FALSE(message.ok()) << size;
    EXPECT_EQ(message.error().problem, DecodeProblem::wrong_length);
  }
}

TYPED_TEST(EveryMessage, RandomPayloadsAreRefusedOrReadExactly) {
  std::mt19937 random(static_cast<unsigned>(TypeParam::kType));
  const std::size_t size = encoded(TypeParam::example()).size();
  for (int trial = 0; trial < 20'000; ++trial) {
    Bytes bytes(trial % 4 != 0 ? size : random() % (kMaxPayloadBytes + 1));
    for (auto& byte : bytes)
      byte = static_cast<std::uint8_t>((random() & 1U) != 0 ? random() & 7U : random());
    const auto message = decode<TypeParam>(bytes);
    if (message.ok()) {
      ASSERT_EQ(encoded(*message), bytes);
    } else {
      ASSERT_NE(message.error().problem, DecodeProblem::none);
    }
  }
}

/// Where the fields of a message without list values begin.
struct OffsetReader {
  void field(const char*, const auto& value, auto...) { take(sizeof value); }
  void choice(const char*, const auto&, auto) { take(1); }
  void list(const char*, const std::uint8_t&, const auto&) { take(1); }
  void take(std::size_t bytes) {
    offsets.push_back(size);
    size += bytes;
  }
  std::vector<std::size_t> offsets;
  std::size_t size = 0;
};

TYPED_TEST(EveryMessage, FieldsBeginWhereItsTableSays) {
  if constexpr (requires { TypeParam::kOffsets; }) {
    OffsetReader read;
    TypeParam message;
    TypeParam::layout(message, read);
    EXPECT_EQ(read.offsets, std::vector(std::begin(TypeParam::kOffsets), std::end(TypeParam::kOffsets)));
  }
}

TYPED_TEST(EveryMessage, FitsItsDelivery) {
  if (delivery_of(TypeParam::kType) == Delivery::datagram) {
    EXPECT_LE(encoded(TypeParam::example()).size(), 32U);
  }
}

TEST(Messages, ValuesOutOfRangeAreRefusedWithTheirField) {
  AddSegment segment = AddSegment::example();
  segment.period_us = 999;
  const auto decoded = decode<AddSegment>(encoded(segment));
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().problem, DecodeProblem::out_of_range);
  EXPECT_EQ(decoded.error().field, 5);  // period_us

  segment = AddSegment::example();
  segment.waveform = static_cast<Waveform>(static_cast<int>(kLastWaveform) + 1);
  EXPECT_EQ(decode<AddSegment>(encoded(segment)).error().field, 1);  // waveform
}

TEST(Messages, PositionBatchOfEveryCount) {
  for (std::uint8_t count = 0; count <= PositionBatch::kMaxCount; ++count) {
    PositionBatch batch = PositionBatch::example();
    batch.count = count;
    for (std::size_t i = 0; i < count; ++i)
      batch.position_microsteps[i] = static_cast<std::int32_t>(i) * -70'000;
    const auto decoded = decode<PositionBatch>(encoded(batch));
    ASSERT_TRUE(decoded.ok());
    EXPECT_EQ(decoded->count, count);
    EXPECT_EQ(decoded->position_microsteps, [&] {
      auto kept = batch.position_microsteps;
      std::fill(kept.begin() + count, kept.end(), 0);
      return kept;
    }());
  }
  Bytes bytes = encoded(PositionBatch::example());
  bytes[16] = PositionBatch::kMaxCount + 1;
  EXPECT_EQ(decode<PositionBatch>(bytes).error().problem, DecodeProblem::out_of_range);
}

TEST(Messages, VisitNamesUnknownTypesAndBadPayloads) {
  Undecodable seen;
  const auto handler = overloaded{[](const auto&) { FAIL(); }, [&](const Undecodable& what) { seen = what; }};
  visit_message(0xEE, {}, handler);
  EXPECT_EQ(seen.type, 0xEE);
  EXPECT_FALSE(seen.known);
  visit_message(static_cast<std::uint8_t>(MessageType::Start), {}, handler);
  EXPECT_TRUE(seen.known);
  EXPECT_EQ(seen.fault.problem, DecodeProblem::wrong_length);
}

TEST(Messages, HelloKeepsItsLayoutForEver) {
  EXPECT_EQ(hex(encoded(HelloRequest::example())), " 01 00 D4 C3 B2 A1 00 01 00");
  EXPECT_EQ(hex(encoded(Hello::example())), " 01 00 D4 C3 B2 A1 00 01 00 02 00 EE FF C0 00 00 BD 01 05 01");
}

}  // namespace
}  // namespace diastole::wire
