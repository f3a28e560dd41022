// Power fails in the middle of a flash operation of an update on the emulated board: whatever the operation, a
// verified image starts afterwards and the update can be brought to its end. Quick: a sample. With
// DIASTOLE_EVERY_POWER_CUT: every operation.

#include <gmock/gmock.h>

#include <random>
#include <set>

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

/// Cells that the cut left between zero and one read anew at each start: among the first and last operations, which are the
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
