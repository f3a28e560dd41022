// Power fails in the middle of a flash operation of an update on the emulated board: whatever the operation, a
// verified image starts afterwards and the update can be brought to its end. Quick: a sample. With
// DIASTOLE_EVERY_POWER_CUT: every operation.

#include <gmock/gmock.h>

#include <random>
#include <set>
#include <utility>

#include "tests/tools/sim_board/flash_bench.hpp"
#include "tests/tools/sim_board/flash_history.hpp"

namespace diastole::sim_board_test {
namespace {

#ifdef DIASTOLE_EVERY_POWER_CUT
constexpr bool every = true;
constexpr size_t recoveries = 60, second_cuts = 60, cell_seeds = 24;
#else
constexpr bool every = false;
constexpr size_t recoveries = 3, second_cuts = 2, cell_seeds = 2;
#endif

struct Score {
  size_t tried = 0, lost = 0;
};

/// Looks what has started, and whether it verifies.
void score_start(FlashBench& bench, size_t cut, Score& score) {
  ++score.tried;
  const auto running = bench.running();
  const bool sound =
      running && running->slot != wire::ImageSlot::none && verifies(bench.board().flash(), running->slot);
  if (!sound) ++score.lost;
  EXPECT_TRUE(sound) << "cut at operation " << cut << ": "
                     << (!running                                 ? "silence"
                         : running->slot == wire::ImageSlot::none ? "unbootable"
                                                                  : "unverified");
}

/// Powers the board with this flash.
void start(FlashBench& bench, const std::vector<uint8_t>& flash, size_t cut, Score& score) {
  bench.board().power_off();
  put_flash(bench.board(), flash);
  bench.power_cycle();
  score_start(bench, cut, score);
}

/// The first and last operations, and a seeded sample of those between; or all.
std::set<size_t> chosen(size_t operations) {
  std::set<size_t> cuts;
  for (size_t cut = 1; cut <= operations; ++cut)
    if (every || cut <= 4 || cut + 8 > operations) cuts.insert(cut);
  std::mt19937 random(2026);
  for (int i = 0; i < 8; ++i)
    cuts.insert(1 + random() % operations);
  return cuts;
}

TEST(FlashPowerCuts, LeaveABoardThatStartsAndCanBeUpdated) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  ASSERT_EQ(bench.runs(), "0.1.0 confirmed");
  FlashHistory history(bench.board());
  ASSERT_EQ(bench.flash(newer_update).end, UpdateEnd::confirmed);
  bench.board().on_flash_change({});
  const size_t operations = history.operations();
  ASSERT_GT(operations, 5'000U);

  Score score;
  std::mt19937 cells(17);
  const std::set<size_t> cuts = chosen(operations);
  for (const size_t cut : cuts) {
    start(bench, history.cut_at(cut), cut, score);
    if (!every || cut % 16 == 0) start(bench, history.cut_at(cut, &cells), cut, score);
  }

  // Recovery, and a power cut during the recovery.
  std::mt19937 random(405);
  Score second;
  for (size_t i = 0; i < recoveries; ++i) {
    const size_t cut = i == 0 ? 1 : i == 1 ? operations : 1 + random() % operations;
    start(bench, history.cut_at(cut, i % 2 == 0 ? nullptr : &cells), cut, score);
    if (i < second_cuts) {
      bench.board().cut_power_at_flash_operation(1 + random() % (i == 1 ? 12 : 200));
      EXPECT_THROW((void)bench.flash(newer_update), HardwareError) << cut;
      bench.board().cut_power_at_flash_operation({});
      const std::vector<uint8_t> left(bench.board().flash().begin(), bench.board().flash().end());
      start(bench, left, cut, second);
    }
    EXPECT_TRUE(bench.flash(newer_update).verified) << cut;
    EXPECT_EQ(bench.runs(), "0.1.1 confirmed") << cut;
  }
  std::printf(
      "%zu operations; %zu cuts tried, %zu survived, %zu lost; cut again during recovery: %zu, %zu lost\n",
      operations, score.tried, score.tried - score.lost, score.lost, second.tried, second.lost);
}

/// Cells that the cut left between zero and one read anew at each reset: among the first and last operations, which are the
/// bootloader's records and the erase, and in the image.
TEST(FlashPowerCuts, LeaveABoardThatStartsWhateverItsCellsRead) {
  NEEDS_UPDATE_IMAGES();
  FlashBench whole;
  (void)whole.runs();
  const uint64_t before = whole.board().statistics().flash_operations;
  (void)whole.flash(newer_update);
  const size_t operations = whole.board().statistics().flash_operations - before;
  std::mt19937 random(7);
  Score score;
  size_t marginal = 0;
  for (uint32_t seed = 1; seed <= cell_seeds; ++seed) {
    const size_t cut = seed % 4 == 0   ? 1 + random() % operations
                       : seed % 2 == 0 ? operations - random() % 12
                                       : 1 + random() % 12;
    FlashBench bench(factory_image, {.cell_seed = seed});
    ASSERT_EQ(bench.runs(), "0.1.0 confirmed");
    bench.board().cut_power_at_flash_operation(cut);
    EXPECT_THROW((void)bench.flash(newer_update), HardwareError) << cut;
    bench.board().cut_power_at_flash_operation({});
    marginal += bench.board().marginal_words();
    for (int starts = 0; starts < 3; ++starts) {
      bench.power_cycle();
      score_start(bench, cut, score);
    }
    EXPECT_TRUE(bench.flash(newer_update).verified) << cut;
    for (int starts = 0; starts < 2; ++starts) {
      bench.power_cycle();
      EXPECT_EQ(bench.runs(), "0.1.1 confirmed") << cut;
    }
  }
  EXPECT_GT(marginal, 0U);
  EXPECT_EQ(score.lost, 0U);
}

/// Words that a cut has hit and that read as they should by chance while the update goes on: the last of signature, header and code.
TEST(FlashPowerCuts, WhatACutMayHaveHitIsWrittenAgain) {
  NEEDS_UPDATE_IMAGES();
  constexpr uint32_t slot_a = 0x0802'0000;
  FlashBench bench(built + "bin/bootloader-stm32f405.bin");
  SimBoard& board = bench.board();
  const UpdateFile file = read_update_file(first_update);
  board.cut_power_at_flash_operation(1'500);
  EXPECT_THROW((void)bench.flash(file), HardwareError);
  board.cut_power_at_flash_operation({});
  bench.power_cycle();
  const auto make_marginal = [&](size_t offset) {
    const uint32_t address = slot_a + static_cast<uint32_t>(offset);
    const uint32_t word = board.word(address).value();
    board.make_marginal(address, ~word & (word + 1));  // the lowest bit that has fallen
  };
  bool begun = false;
  const UpdateResult result = bench.flash(
      file, {.say = [&](const std::string&) {
        if (std::exchange(begun, true)) return;  // it waits in its bootloader
        const auto slot = board.flash().subspan(0x2'0000, 0x2'0000);
        size_t torn = slot.size();
        while (slot[torn - 1] == 0xff)
          --torn;
        torn = (torn - 1) / 4 * 4;
        board.load(std::span(file.images[0].code).subspan(torn - wire::kImageHeaderArea, 4),
                   slot_a + static_cast<uint32_t>(torn));
        for (const size_t offset : {wire::kSignedHeaderBytes - 4, wire::kImageHeaderBytes - 4, torn})
          make_marginal(offset);
      }});
  EXPECT_TRUE(result.verified);
  EXPECT_LT(result.sent_bytes, result.image_bytes) << "it went on";
  EXPECT_EQ(board.marginal_words(), 0U);
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
}

/// One bit of the confirmed image that each reset reads anew, also the one between the bootloader's judgement and its jump.
TEST(FlashPowerCuts, NoImageIsEnteredThatReadsOtherwiseThanItWasJudged) {
  NEEDS_UPDATE_IMAGES();
  constexpr uint32_t vector_table = 0xE000'ED08, slot_a = 0x0802'0000, slot_b = 0x0804'0000;
  constexpr int starts = 16;
  FlashBench bench;
  ASSERT_EQ(bench.flash(newer_update).end, UpdateEnd::confirmed);  // into slot B; slot A still holds 0.1.0
  bench.board().power_off();
  bench.remove_key();
  bench.board().make_marginal(slot_b + 0x1000, 1);
  int entered_b = 0, judged_again = 0;
  for (int start = 0; start < starts; ++start) {
    const size_t resets = bench.board().statistics().resets.size();
    bench.power_cycle();
    bench.desk.sleep_until_ns(bench.desk.now_ns() + 150 * ms, nullptr);
    const uint32_t vectors = bench.board().peripheral_word(vector_table);
    ASSERT_GE(vectors, slot_a) << "the bootloader has entered nothing";
    const bool in_b = vectors >= slot_b;
    EXPECT_TRUE(verifies(bench.board().flash(), in_b ? wire::ImageSlot::b : wire::ImageSlot::a)) << start;
    entered_b += in_b ? 1 : 0;
    judged_again += bench.board().statistics().resets.size() > resets + 2 ? 1 : 0;
  }
  EXPECT_GT(judged_again, 0) << "it never changed between judgement and jump";
  EXPECT_GT(entered_b, 0);
  EXPECT_LT(entered_b, starts - judged_again) << "it never read wrong at once";
}

// The reconstruction of a cut is the emulator's own.
TEST(FlashPowerCuts, AreReconstructedToTheByte) {
  NEEDS_UPDATE_IMAGES();
  FlashBench whole;
  (void)whole.runs();
  FlashHistory history(whole.board());
  (void)whole.flash(newer_update);
  whole.board().on_flash_change({});
  for (const size_t cut : {size_t{1}, size_t{40}, size_t{1'000}}) {
    FlashBench bench;
    (void)bench.runs();
    bench.board().cut_power_at_flash_operation(cut);
    EXPECT_THROW((void)bench.flash(newer_update), HardwareError);
    EXPECT_TRUE(std::ranges::equal(bench.board().flash(), history.cut_at(cut))) << cut;
  }
}

}  // namespace
}  // namespace diastole::sim_board_test
