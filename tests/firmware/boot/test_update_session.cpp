// Updates on slots in memory: what is refused, what is resumed, and what a power cut at every operation leaves.

#include "firmware/boot/update_session.hpp"

#include <gtest/gtest.h>

#include "tests/firmware/boot/update_bench.hpp"

namespace diastole::boot_test {
namespace {

TEST(UpdateSession, InstallsTriesAndConfirms) {
  MemorySlots slots = factory_new();
  const TestImage newer = make_image(4096, {0, 1, 1}, 2);
  ASSERT_EQ(install(slots, newer), UpdateOutcome::done);
  const auto trial = start(slots);
  EXPECT_EQ(trial.start, ImageSlot::b);
  EXPECT_TRUE(trial.trial);
  confirm(slots, ImageSlot::b);
  EXPECT_EQ(start(slots).start, ImageSlot::b);
  EXPECT_EQ(decide(slots).free, ImageSlot::a);
}

TEST(UpdateSession, RefusesWithAReason) {
  MemorySlots slots = factory_new();
  const wire::ImageHeader good = make_image(512, {0, 2, 0}, 3).header[1];
  const auto outcome = [&](wire::ImageHeader header, bool allow_older = false) {
    const std::uint64_t before = slots.operations();
    UpdateSession session(slots);
    const auto reply = session.begin(begin_of(header, allow_older));
    if (reply.outcome != UpdateOutcome::done) {
      EXPECT_EQ(slots.operations(), before) << "flash was touched";
    }
    return std::pair(reply.outcome, reply.value);
  };
  wire::ImageHeader header = good;
  header.board_id = 1;
  EXPECT_EQ(outcome(header), std::pair(UpdateOutcome::wrong_board, std::uint32_t{MemorySlots::kBoard}));
  header = good;
  header.link_address = 0x0802'0000;
  EXPECT_EQ(outcome(header), std::pair(UpdateOutcome::wrong_slot, 0x0804'0000U));
  header = good;
  header.code_bytes = 0x2'0000 - 508;
  EXPECT_EQ(outcome(header), std::pair(UpdateOutcome::too_long, 0x2'0000U - 512));
  header = good;
  header.code_bytes = 3;
  EXPECT_EQ(outcome(header).first, UpdateOutcome::bad_header);
  header = good;
  header.version = {0, 0, 9};
  EXPECT_EQ(outcome(header), std::pair(UpdateOutcome::older_version, 0x000100U));
  EXPECT_EQ(outcome(header, true).first, UpdateOutcome::done);

  UpdateSession session(slots);
  wire::BeginUpdate damaged = begin_of(good);
  damaged.header[16] ^= 1;
  EXPECT_EQ(session.begin(damaged).outcome, UpdateOutcome::bad_header);
  EXPECT_EQ(session.add({}).outcome, UpdateOutcome::not_begun);
  EXPECT_EQ(session.finish().outcome, UpdateOutcome::not_begun);
  ASSERT_EQ(session.begin(begin_of(good)).outcome, UpdateOutcome::done);
  wire::UpdateData data;
  data.count = 4;
  data.offset = 4;
  EXPECT_EQ(session.add(data).outcome, UpdateOutcome::wrong_offset);
  data.offset = 0;
  data.count = 3;
  EXPECT_EQ(session.add(data).outcome, UpdateOutcome::malformed);
  EXPECT_EQ(session.finish().outcome, UpdateOutcome::wrong_offset) << "not all is there";
}

TEST(UpdateSession, AnyWrongByteOfTheCodeIsRefused) {
  const TestImage newer = make_image(512, {0, 1, 1}, 4);
  for (std::size_t at = 0; at < newer.code.size(); ++at) {
    MemorySlots slots = factory_new();
    TestImage corrupt = newer;
    corrupt.code[at] ^= 0x10;
    ASSERT_EQ(install(slots, corrupt), UpdateOutcome::not_verified) << at;
    ASSERT_EQ(start(slots).start, ImageSlot::a);
    ASSERT_EQ(install(slots, newer), UpdateOutcome::done) << "the right one goes in afterwards";
  }
}

TEST(UpdateSession, ResumesWhereItWasInterrupted) {
  const TestImage newer = make_image(4096, {0, 1, 1}, 5);
  MemorySlots slots = factory_new();
  slots.cut_power_at(700, 5);
  ASSERT_THROW((void)install(slots, newer), PowerCut);
  slots.never_cut_power();
  std::size_t sent_bytes = 0;
  ASSERT_EQ(install(slots, newer, &sent_bytes), UpdateOutcome::done);
  EXPECT_LT(sent_bytes, 4096U - 4 * 600);
}

TEST(UpdateSession, AnotherImageStartsAnew) {
  MemorySlots slots = factory_new();
  slots.cut_power_at(700, 6);
  ASSERT_THROW((void)install(slots, make_image(4096, {0, 1, 1}, 6)), PowerCut);
  slots.never_cut_power();
  const TestImage other = make_image(4096, {0, 1, 2}, 7);
  std::size_t sent_bytes = 0;
  ASSERT_EQ(install(slots, other, &sent_bytes), UpdateOutcome::done);
  EXPECT_EQ(sent_bytes, other.code.size());
}

/// What an update that is cut off in the middle of its erases, at each of its first operations, leaves behind.
TEST(UpdateSession, ErasesASlotAgainThatMerelyReadsBlank) {
  const TestImage newer = make_image(60'000, {0, 1, 1}, 12);
  int weak_slots = 0;
  for (std::uint64_t cut = 1; cut <= 12; ++cut) {
    MemorySlots slots = factory_new();
    ASSERT_EQ(install(slots, make_image(4096, {0, 1, 1}, 11)), UpdateOutcome::done);
    (void)start(slots);  // tried, and never confirmed
    slots.cut_erases_late();
    slots.cut_power_at(cut, static_cast<std::uint32_t>(cut));
    ASSERT_THROW((void)install(slots, newer), PowerCut);
    slots.never_cut_power();
    weak_slots += boot::is_erased(slots.slot(ImageSlot::b)) ? 1 : 0;
    EXPECT_EQ(decide(slots).start, ImageSlot::a) << cut;
    ASSERT_EQ(install(slots, newer), UpdateOutcome::done) << cut;
    slots.let_weak_cells_fall();
    EXPECT_TRUE(inspect(slots, ImageSlot::b).verified) << "cells that were never wholly erased, cut " << cut;
  }
  EXPECT_GE(weak_slots, 1) << "no cut hit the erase";
}

TEST(UpdateSession, AHalfErasedSlotIsNotResumedThoughItsHeaderStands) {
  const TestImage held = make_image(4096, {0, 1, 1}, 13);
  MemorySlots slots = factory_new();
  ASSERT_EQ(install(slots, held), UpdateOutcome::done);
  // The erase for another image began, and what stood there reads as before.
  ASSERT_TRUE(append(slots, {BootEvent::erase_begun, ImageSlot::b, {}}));
  EXPECT_EQ(decide(slots).state[1], ImageState::empty);
  EXPECT_EQ(decide(slots).start, ImageSlot::a);
  std::size_t sent_bytes = 0;
  ASSERT_EQ(install(slots, held, &sent_bytes), UpdateOutcome::done);
  EXPECT_EQ(sent_bytes, held.code.size());
}

TEST(UpdateSession, TouchesNoFlashWhileTheSupplyIsLow) {
  MemorySlots slots = factory_new();
  const TestImage newer = make_image(512, {0, 1, 1}, 14);
  UpdateSession session(slots);
  slots.set_supply_sound(false);
  const std::uint64_t before = slots.operations();
  EXPECT_EQ(session.begin(begin_of(newer.header[1])).outcome, UpdateOutcome::supply_low);
  EXPECT_EQ(slots.operations(), before);
  slots.set_supply_sound(true);
  ASSERT_EQ(session.begin(begin_of(newer.header[1])).outcome, UpdateOutcome::done);
  slots.set_supply_sound(false);
  const std::uint64_t begun = slots.operations();
  wire::UpdateData data;
  data.count = 4;
  EXPECT_EQ(session.add(data).outcome, UpdateOutcome::supply_low);
  EXPECT_EQ(slots.operations(), begun);
  slots.set_supply_sound(true);
  ASSERT_EQ(install(slots, newer), UpdateOutcome::done) << "nothing was lost";
}

TEST(UpdateSession, ManyUpdatesOutliveTheRecordSector) {
  MemorySlots slots = factory_new(old_image, 64 * boot::kRecordBytes);
  for (std::uint32_t round = 0; round < 200; ++round) {
    const TestImage next = make_image(64, {0, 1, static_cast<std::uint8_t>(round)}, 100 + round);
    const ImageSlot free = decide(slots).free;
    ASSERT_EQ(install(slots, next), UpdateOutcome::done) << round;
    const auto trial = start(slots);
    ASSERT_EQ(trial.start, free);
    ASSERT_TRUE(trial.trial);
    confirm(slots, free);
    ASSERT_EQ(decide(slots).start, free);
  }
}

/// One update from factory state, power failing at operation `cut`; true if it did not come to that.
struct PowerCutCampaign {
  std::uint64_t tried = 0, resumed = 0;

  /// Holds after any cut: something verified starts, and it is the old image unless the new one is on trial
  /// or confirmed.
  static void expect_sound(MemorySlots& slots, const char* when) {
    const auto decision = start(slots);
    ASSERT_NE(decision.start, ImageSlot::none) << when << ": unbootable";
    ASSERT_TRUE(inspect(slots, decision.start).verified) << when << ": unverified image started";
  }

  /// An update with its trial and confirmation; throws PowerCut.
  static void update(MemorySlots& slots, const TestImage& image) {
    ASSERT_EQ(install(slots, image), UpdateOutcome::done);
    const auto trial = start(slots);
    ASSERT_TRUE(trial.trial);
    confirm(slots, trial.start);
  }

  static bool runs(MemorySlots& slots, const TestImage& image) {
    const auto decision = decide(slots);
    return decision.start != ImageSlot::none &&
           inspect(slots, decision.start).tag == tag(image, decision.start) &&
           decision.state[static_cast<std::size_t>(decision.start)] == ImageState::confirmed;
  }

  /// Every cut in [1, operations], with `stride` from `first`.
  void run(const MemorySlots& before, const TestImage& image, std::uint64_t first, std::uint64_t stride) {
    MemorySlots whole = before;
    update(whole, image);
    const std::uint64_t operations = whole.operations() - before.operations();
    for (std::uint64_t cut = first; cut <= operations; cut += stride) {
      MemorySlots slots = before;
      slots.cut_power_at(cut, static_cast<std::uint32_t>(cut));
      ASSERT_THROW(update(slots, image), PowerCut);
      slots.never_cut_power();
      ++tried;
      ASSERT_NO_FATAL_FAILURE(expect_sound(slots, "after the cut")) << cut;
      if (!runs(slots, image)) {
        ASSERT_NO_FATAL_FAILURE(update(slots, image)) << cut;
        ++resumed;
      }
      ASSERT_TRUE(runs(slots, image)) << cut;
    }
  }

  /// Every cut of an update, and every `stride`-th cut of the recovery from it.
  void run_nested(const MemorySlots& before, const TestImage& image, std::uint64_t stride) {
    MemorySlots whole = before;
    update(whole, image);
    const std::uint64_t operations = whole.operations() - before.operations();
    for (std::uint64_t cut = 1; cut <= operations; ++cut) {
      MemorySlots broken = before;
      broken.cut_power_at(cut, static_cast<std::uint32_t>(cut));
      ASSERT_THROW(update(broken, image), PowerCut);
      for (std::uint64_t again = 1 + cut % stride;; again += stride) {
        MemorySlots slots = broken;
        slots.cut_power_at(again, static_cast<std::uint32_t>(cut * 7919 + again));
        bool came_to_it = false;
        try {
          (void)start(slots);
          if (!runs(slots, image)) update(slots, image);
        } catch (const PowerCut&) {
          came_to_it = true;
        }
        slots.never_cut_power();
        ++tried;
        ASSERT_NO_FATAL_FAILURE(expect_sound(slots, "after the second cut")) << cut << ", " << again;
        if (!runs(slots, image)) {
          ASSERT_NO_FATAL_FAILURE(update(slots, image)) << cut << ", " << again;
        }
        ASSERT_TRUE(runs(slots, image)) << cut << ", " << again;
        if (!came_to_it) break;
      }
    }
  }
};

TEST(PowerCuts, AtEveryOperationOfAnUpdate) {
  PowerCutCampaign campaign;
  campaign.run(factory_new(), make_image(6000, {0, 1, 1}, 8), 1, 1);
  std::printf("%llu cuts tried, %llu updates resumed, 0 lost\n",
              static_cast<unsigned long long>(campaign.tried),
              static_cast<unsigned long long>(campaign.resumed));
}

TEST(PowerCuts, AtEveryOperationWhileTheRecordsAreCompacted) {
  // Old updates have all but filled the sector; images of the past fill both slots.
  MemorySlots slots = factory_new(old_image, 40 * boot::kRecordBytes);
  for (std::uint32_t round = 0; boot::records_left(slots.records()) >= 16; ++round)
    PowerCutCampaign::update(slots, make_image(64, {0, 1, 0}, 200 + round));
  PowerCutCampaign campaign;
  for (std::uint32_t seed = 0; seed < 40; ++seed)
    campaign.run(slots, make_image(64, {0, 1, 1}, 300 + seed), 1, 1);
  std::printf("%llu cuts tried\n", static_cast<unsigned long long>(campaign.tried));
}

TEST(PowerCuts, DuringTheRecoveryFromACut) {
  PowerCutCampaign campaign;
  campaign.run_nested(factory_new(), make_image(200, {0, 1, 1}, 9), 1);
  MemorySlots nearly_full = factory_new(old_image, 40 * boot::kRecordBytes);
  for (std::uint32_t round = 0; boot::records_left(nearly_full.records()) >= 16; ++round)
    PowerCutCampaign::update(nearly_full, make_image(64, {0, 1, 0}, 400 + round));
  campaign.run_nested(nearly_full, make_image(64, {0, 1, 1}, 10), 1);
  std::printf("%llu pairs of cuts tried\n", static_cast<unsigned long long>(campaign.tried));
}

}  // namespace
}  // namespace diastole::boot_test
