// The decision alone: cases, and properties over random records and slots.

#include "firmware/boot/boot_decision.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace diastole::boot {
namespace {

using wire::ImageSlot;
using wire::ImageState;

constexpr ImageTag tag_a{1, 2, 3, 4, 5, 6, 7, 8}, tag_b{8, 7, 6, 5, 4, 3, 2, 1}, other_tag{9};
constexpr std::array<SlotFacts, 2> both_whole{{{true, true, tag_a}, {true, true, tag_b}}};

std::vector<std::uint8_t> sector(std::initializer_list<BootRecord> records, std::size_t bytes = 1024) {
  std::vector<std::uint8_t> written(bytes, 0xFF);
  auto at = written.begin();
  for (const BootRecord& record : records) {
    const RecordBytes encoded = encode(record);
    at = std::copy(encoded.begin(), encoded.end(), at);
  }
  return written;
}

BootRecord record(BootEvent event, ImageSlot slot) {
  return {event, slot, slot == ImageSlot::a ? tag_a : tag_b};
}

TEST(BootRecords, EncodeToTheBytesInTheirHeader) {
  const RecordBytes expected{0x42, 0x52, 0x03, 0x00, 0x01, 0x02, 0x03, 0x04,
                             0x05, 0x06, 0x07, 0x08, 0x4A, 0x67, 0x80, 0x36};
  EXPECT_EQ(encode(record(BootEvent::confirmed, ImageSlot::a)), expected);
  EXPECT_EQ(decode_record(expected), record(BootEvent::confirmed, ImageSlot::a));
}

TEST(BootRecords, AnyFlippedBitIsNoticed) {
  const RecordBytes whole = encode(record(BootEvent::installed, ImageSlot::b));
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    RecordBytes flipped = whole;
    flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ 1U << bit % 8);
    ASSERT_FALSE(decode_record(flipped)) << "bit " << bit;
  }
}

TEST(BootRecords, TheNextOneGoesBehindWhateverIsWritten) {
  auto bytes = sector({record(BootEvent::confirmed, ImageSlot::a)});
  EXPECT_EQ(next_record_offset(bytes), kRecordBytes);
  bytes[40] = 0x7F;  // the remains of a torn record
  EXPECT_EQ(next_record_offset(bytes), 3 * kRecordBytes);
  EXPECT_EQ(next_record_offset(sector({})), 0U);
  bytes.back() = 0;
  EXPECT_EQ(records_left(bytes), 0U);
}

TEST(BootDecision, StartsTheImageConfirmedLast) {
  const auto records =
      sector({record(BootEvent::confirmed, ImageSlot::a), record(BootEvent::confirmed, ImageSlot::b)});
  const BootDecision decision = decide(records, both_whole);
  EXPECT_EQ(decision.start, ImageSlot::b);
  EXPECT_FALSE(decision.trial);
  EXPECT_EQ(decision.free, ImageSlot::a);
}

TEST(BootDecision, TriesAnInstalledImageOnceAndReturns) {
  const auto installed =
      sector({record(BootEvent::confirmed, ImageSlot::a), record(BootEvent::installed, ImageSlot::b)});
  const BootDecision first = decide(installed, both_whole);
  EXPECT_EQ(first.start, ImageSlot::b);
  EXPECT_TRUE(first.trial);
  EXPECT_EQ(first.free, ImageSlot::b) << "the confirmed image is not to be overwritten";
  const auto tried =
      sector({record(BootEvent::confirmed, ImageSlot::a), record(BootEvent::installed, ImageSlot::b),
              record(BootEvent::tried, ImageSlot::b)});
  const BootDecision second = decide(tried, both_whole);
  EXPECT_EQ(second.start, ImageSlot::a);
  EXPECT_FALSE(second.trial);
  EXPECT_EQ(second.state[1], ImageState::failed);
}

TEST(BootDecision, DoesNotTryWhatItCannotRecord) {
  const auto records =
      sector({record(BootEvent::confirmed, ImageSlot::a), record(BootEvent::installed, ImageSlot::b)},
             2 * kRecordBytes);
  EXPECT_EQ(decide(records, both_whole).start, ImageSlot::a);
}

TEST(BootDecision, RecordsOfAnotherImageSayNothing) {
  const auto records =
      sector({{BootEvent::installed, ImageSlot::b, other_tag}, record(BootEvent::confirmed, ImageSlot::a)});
  const BootDecision decision = decide(records, both_whole);
  EXPECT_EQ(decision.start, ImageSlot::a);
  EXPECT_EQ(decision.state[1], ImageState::unrecorded);
}

TEST(BootDecision, PrefersAnUnknownImageToAFailedOneAndAFailedOneToNone) {
  const auto records = sector({record(BootEvent::tried, ImageSlot::a)});
  EXPECT_EQ(decide(records, both_whole).start, ImageSlot::b);
  auto only_a = both_whole;
  only_a[1].verified = false;
  EXPECT_EQ(decide(records, only_a).start, ImageSlot::a);
  EXPECT_FALSE(decide(records, only_a).trial);
  EXPECT_EQ(decide(records, only_a).free, ImageSlot::b);
}

TEST(BootDecision, StaysIfNothingVerifies) {
  const auto records = sector({record(BootEvent::confirmed, ImageSlot::a)});
  EXPECT_EQ(decide(records, {{{true, false, tag_a}, {}}}).start, ImageSlot::none);
}

// Whatever the records hold: only what verifies is started; something is, if anything verifies; the slot that
// an update would overwrite is never the one to be kept; a trial is of an installed image.
TEST(BootDecision, HoldsItsPromisesForRandomRecordsAndSlots) {
  std::mt19937 random(405);
  for (int round = 0; round < 200'000; ++round) {
    std::array<SlotFacts, 2> slots{};
    for (std::size_t i = 0; i < 2; ++i) {
      slots[i].has_header = random() % 4 != 0;
      slots[i].verified = slots[i].has_header && random() % 4 != 0;
      slots[i].tag = i == 0 ? tag_a : tag_b;
    }
    std::vector<std::uint8_t> records(kRecordBytes * (1 + random() % 8), 0xFF);
    const std::size_t written = random() % (records.size() / kRecordBytes + 1);
    for (std::size_t i = 0; i < written; ++i) {
      const auto slot = static_cast<ImageSlot>(random() % 2);
      RecordBytes encoded = encode({static_cast<BootEvent>(1 + random() % 3), slot,
                                    random() % 8 == 0      ? other_tag
                                    : slot == ImageSlot::a ? tag_a
                                                           : tag_b});
      if (random() % 8 == 0) encoded[random() % kRecordBytes] = static_cast<std::uint8_t>(random());
      std::copy(encoded.begin(), encoded.end(),
                records.begin() + static_cast<std::ptrdiff_t>(i * kRecordBytes));
    }
    const BootDecision decision = decide(records, slots);
    const bool any = slots[0].verified || slots[1].verified;
    ASSERT_EQ(decision.start != ImageSlot::none, any);
    if (any) {
      ASSERT_TRUE(slots[static_cast<std::size_t>(decision.start)].verified);
      ASSERT_NE(decision.free, decision.keep);
    }
    if (decision.trial) {
      ASSERT_EQ(decision.state[static_cast<std::size_t>(decision.start)], ImageState::installed);
      ASSERT_GT(records_left(records), 0U);
    }
  }
}

}  // namespace
}  // namespace diastole::boot
