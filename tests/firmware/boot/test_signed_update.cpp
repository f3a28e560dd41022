// A board with a key: what it refuses, what it still takes, and the rollback counter over power cuts.

#include "tests/firmware/boot/update_bench.hpp"

namespace diastole::boot_test {
namespace {

constexpr signing::SecretKey ours{1, 2, 3}, theirs{3, 2, 1};

TestImage image_of(wire::FirmwareVersion version, std::uint32_t counter, std::uint32_t seed,
                   const signing::SecretKey& key = ours) {
  return signed_by(make_image(256, version, seed), key, counter);
}

/// Slot A holds a confirmed image of our laboratory, counter 5.
MemorySlots locked_board(std::size_t record_bytes = 0x4000) {
  MemorySlots slots = factory_new(image_of({0, 1, 0}, 5, 1), record_bytes);
  slots.lock(signing::public_key_of(ours));
  return slots;
}

void expect_refused(const TestImage& image, UpdateOutcome reason) {
  MemorySlots slots = locked_board();
  const std::uint64_t before = slots.operations();
  EXPECT_EQ(install(slots, image), reason);
  EXPECT_EQ(slots.operations(), before) << "flash was touched";
  EXPECT_EQ(decide(slots).start, ImageSlot::a);
}

TEST(SignedUpdate, IsTakenAndStarted) {
  MemorySlots slots = locked_board();
  const TestImage newer = image_of({0, 1, 1}, 5, 2);
  ASSERT_EQ(install(slots, newer), UpdateOutcome::done);
  EXPECT_EQ(start(slots).start, ImageSlot::b);
  confirm(slots, ImageSlot::b);
  EXPECT_EQ(start(slots).state[1], ImageState::confirmed);
}

TEST(SignedUpdate, IsRefusedWithoutASignatureOrWithAnothers) {
  const TestImage good = image_of({0, 1, 1}, 5, 3);
  expect_refused(make_image(256, {0, 1, 1}, 3), UpdateOutcome::not_signed);
  TestImage blank = good;
  for (auto& signature : blank.signature)
    signature = wire::ImageSignature{.counter = 5};
  expect_refused(blank, UpdateOutcome::not_signed);
  expect_refused(image_of({0, 1, 1}, 5, 3, theirs), UpdateOutcome::wrong_signature);
  TestImage raised = good;  // signed for another counter
  raised.signature[1]->counter = 6;
  expect_refused(raised, UpdateOutcome::wrong_signature);
  TestImage other = good;  // signed for another image
  other.signature[1] = image_of({0, 1, 1}, 5, 4).signature[1];
  expect_refused(other, UpdateOutcome::wrong_signature);
  TestImage exchanged = good;  // signed for the other slot
  exchanged.signature[1] = good.signature[0];
  expect_refused(exchanged, UpdateOutcome::wrong_signature);
}

TEST(SignedUpdate, IsRefusedBelowTheRollbackCounterWhateverTheHostAllows) {
  MemorySlots slots = locked_board();
  const TestImage below = image_of({0, 1, 1}, 4, 5);
  UpdateSession session(slots);
  wire::BeginUpdate begin = begin_of(below.header[1], true);
  begin.header_bytes = wire::kSignedHeaderBytes;
  const auto block = wire::encode(*below.signature[1]);
  std::copy(block.begin(), block.end(), begin.header.begin() + wire::kImageSignatureAt);
  const auto reply = session.begin(begin);
  EXPECT_EQ(reply.outcome, UpdateOutcome::rolled_back);
  EXPECT_EQ(reply.value, 5U);
}

TEST(SignedUpdate, WhatIsBelowTheCounterIsNotStartedThoughNothingElseIsLeft) {
  MemorySlots slots = locked_board();
  const TestImage newer = image_of({0, 1, 1}, 9, 6);
  ASSERT_EQ(install(slots, newer), UpdateOutcome::done);
  (void)start(slots);
  confirm(slots, ImageSlot::b);
  EXPECT_EQ(start(slots).start, ImageSlot::b);
  EXPECT_EQ(boot::recorded_counter(slots.records()), 9U);
  slots.bytes(ImageSlot::b)[wire::kImageHeaderArea] ^= 1;
  const auto decision = decide(slots);
  EXPECT_EQ(decision.start, ImageSlot::none);
  EXPECT_EQ(decision.state[0], ImageState::refused);
  const TestImage below = image_of({0, 2, 0}, 8, 7);
  EXPECT_EQ(install(slots, below), UpdateOutcome::rolled_back);
  EXPECT_EQ(install(slots, image_of({0, 2, 0}, 9, 8)), UpdateOutcome::done);
}

TEST(SignedUpdate, AnImageThatCameByAnotherWayIsNotStartedUnsigned) {
  MemorySlots slots = locked_board();
  const TestImage planted = make_image(256, {9, 9, 9}, 9);
  put(slots, ImageSlot::b, planted);
  ASSERT_TRUE(append(slots, {BootEvent::confirmed, ImageSlot::b, tag(planted, ImageSlot::b)}));
  const auto decision = decide(slots);
  EXPECT_EQ(decision.start, ImageSlot::a);
  EXPECT_EQ(decision.state[1], ImageState::refused);
}

TEST(SignedUpdate, ABoardWithoutAKeyTakesAnything) {
  MemorySlots slots = factory_new();
  EXPECT_EQ(install(slots, image_of({0, 1, 1}, 0, 10, theirs)), UpdateOutcome::done);
  EXPECT_EQ(install(slots, make_image(256, {0, 1, 2}, 11)), UpdateOutcome::done);
}

/// What holds after whatever cut: an image of our laboratory starts, and what is below the counter is refused.
void expect_shut(MemorySlots& slots, std::uint32_t counter, std::uint64_t cut) {
  const auto decision = start(slots);
  ASSERT_NE(decision.start, ImageSlot::none) << "unbootable, cut " << cut;
  EXPECT_GE(boot::rollback_counter(slots, decision), counter) << "cut " << cut;
  EXPECT_EQ(install(slots, image_of({9, 0, 0}, counter - 1, 12)), UpdateOutcome::rolled_back)
      << "cut " << cut;
  EXPECT_EQ(install(slots, make_image(256, {9, 0, 0}, 12)), UpdateOutcome::not_signed) << "cut " << cut;
}

/// The counter rises from 5 to 6 with an update, power failing at every operation from the confirmation on: of the record
/// of the confirmation, of the counter, and of the next update, which erases the records if they are nearly full.
std::uint64_t cut_everywhere(const MemorySlots& before, bool full_records) {
  const TestImage raising = image_of({0, 1, 1}, 6, 13), next = image_of({0, 1, 2}, 6, 14);
  const auto raise = [&](MemorySlots& slots) {
    confirm(slots, ImageSlot::b);
    (void)start(slots);
    ASSERT_EQ(install(slots, next), UpdateOutcome::done);
    (void)start(slots);
    confirm(slots, ImageSlot::a);
    (void)start(slots);
  };
  MemorySlots tried = before;
  EXPECT_EQ(install(tried, raising), UpdateOutcome::done);
  (void)start(tried);
  MemorySlots whole = tried;
  raise(whole);
  const std::uint64_t operations = whole.operations() - tried.operations();
  // Of the image's own words every eighth.
  std::uint64_t cuts = 0;
  for (std::uint64_t cut = 1; cut <= operations; cut += cut < 40 || cut + 20 > operations ? 1 : 8, ++cuts) {
    MemorySlots slots = tried;
    slots.cut_power_at(cut, static_cast<std::uint32_t>(cut));
    EXPECT_THROW(raise(slots), PowerCut);
    slots.never_cut_power();
    const bool confirmed = decide(slots).keep != ImageSlot::a || boot::recorded_counter(slots.records()) > 5;
    expect_shut(slots, confirmed ? 6 : 5, cut);
  }
  EXPECT_EQ(boot::recorded_counter(whole.records()), 6U) << full_records;
  return cuts;
}

TEST(RollbackCounter, OutlivesAPowerCutAtEveryOperationOfItsUpdate) {
  std::uint64_t cuts = cut_everywhere(locked_board(), false);
  MemorySlots nearly_full = locked_board(24 * boot::kRecordBytes);
  while (boot::records_left(nearly_full.records()) > 17)
    ASSERT_TRUE(append(nearly_full, {BootEvent::erased, ImageSlot::b, {}}));
  cuts += cut_everywhere(nearly_full, true);
  std::printf("%llu cuts tried, the counter never fell\n", static_cast<unsigned long long>(cuts));
  EXPECT_GT(cuts, 80U);
}

/// The confirmed image of 5 was replaced by SWD, past the bootloader, by one of 9 that nobody has confirmed; and the next
/// update writes the nearly full records anew.
TEST(RollbackCounter, IsNotRecordedOfAnImageThatNobodyHasConfirmed) {
  MemorySlots slots = locked_board(24 * boot::kRecordBytes);
  (void)start(slots);
  ASSERT_EQ(boot::recorded_counter(slots.records()), 5U);
  const auto replace = [&](std::uint32_t counter) {
    ASSERT_TRUE(slots.erase_slot(ImageSlot::a));
    put(slots, ImageSlot::a, image_of({0, 1, 0}, counter, 20));
  };
  replace(9);
  while (boot::records_left(slots.records()) > 15)
    ASSERT_TRUE(append(slots, {BootEvent::erased, ImageSlot::b, {}}));
  EXPECT_EQ(install(slots, image_of({0, 1, 1}, 8, 21)), UpdateOutcome::rolled_back) << "while it is kept";
  ASSERT_EQ(install(slots, image_of({0, 1, 1}, 9, 22)), UpdateOutcome::done);
  ASSERT_GT(boot::records_left(slots.records()), 20U) << "not written anew";
  EXPECT_EQ(boot::recorded_counter(slots.records()), 5U);
  EXPECT_TRUE(start(slots).trial);
  EXPECT_EQ(boot::recorded_counter(slots.records()), 5U) << "nor on trial";
  EXPECT_EQ(start(slots).keep, ImageSlot::a) << "nobody has confirmed that one either";
  EXPECT_EQ(boot::recorded_counter(slots.records()), 5U);
  replace(6);
  EXPECT_EQ(start(slots).start, ImageSlot::a) << "the laboratory goes back by SWD";
  EXPECT_EQ(install(slots, image_of({0, 1, 1}, 6, 23)), UpdateOutcome::done);
  (void)start(slots);
  confirm(slots, ImageSlot::b);
  (void)start(slots);
  EXPECT_EQ(boot::recorded_counter(slots.records()), 6U);
}

}  // namespace
}  // namespace diastole::boot_test
