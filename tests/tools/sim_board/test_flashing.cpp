// `diastole flash` against the real bootloader and applications on the emulated board, in virtual time.

#include <gmock/gmock.h>

#include "tests/tools/sim_board/flash_bench.hpp"

namespace diastole::sim_board_test {
namespace {

using ::testing::HasSubstr;

template <class Error>
std::string output_of(FlashBench& bench, const std::string& file, const UpdateOptions& options = {}) {
  try {
    (void)bench.flash(file, options);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(Flashing, InstallsTriesAndConfirmsANewerFirmware) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  ASSERT_EQ(bench.runs(), "0.1.0 confirmed");
  uint32_t last = 0;
  const UpdateResult result = bench.flash(newer_update, {.progress = [&](uint32_t held, uint32_t total) {
                                            EXPECT_GE(held, last);
                                            EXPECT_LE(held, total);
                                            last = held;
                                          }});
  EXPECT_EQ(result.end, UpdateEnd::confirmed);
  EXPECT_TRUE(result.verified);
  EXPECT_EQ(result.sent_bytes, result.image_bytes);
  EXPECT_EQ(last, result.image_bytes);
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
  // While a sector is erased the core stands still, and what arrives then is lost: the link sends it again.
  const uint64_t lost = bench.board().statistics().serial_overruns;

  const UpdateResult again = bench.flash(newer_update);
  EXPECT_EQ(again.end, UpdateEnd::already_there);
  EXPECT_EQ(again.sent_bytes, 0U);
  EXPECT_EQ(bench.board().statistics().serial_overruns, lost);
}

TEST(Flashing, ReturnsToAnImageThatWasConfirmedLongAgo) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  (void)bench.flash(newer_update);
  EXPECT_THAT(output_of<InputError>(bench, first_update), HasSubstr("0.1.0 is older than 0.1.1"));
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
  const UpdateResult result = bench.flash(first_update, {.allow_older = true});
  EXPECT_LT(result.sent_bytes, 8U) << "slot A still holds it";
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
}

TEST(Flashing, AnImageThatHangsGivesWayToTheConfirmedOne) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  EXPECT_THAT(output_of<HardwareError>(bench, hanging_update), HasSubstr("has returned to 0.1.0"));
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
  EXPECT_EQ(bench.board().statistics().resets.back().cause, "software");
  EXPECT_EQ(bench.flash(newer_update).end, UpdateEnd::confirmed);
}

TEST(Flashing, AnImageThatNobodyConfirmsGivesWayByItself) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  // The host's line is cut when the new image is about to start.
  (void)output_of<HardwareError>(bench, newer_update, {.say = [&](const std::string& words) {
                                   if (words.find("starting") != std::string::npos)
                                     throw HardwareError("host", "gone", "");
                                 }});
  EXPECT_EQ(bench.runs(), "0.1.1 unconfirmed");
  bench.desk.sleep_until_ns(bench.desk.now_ns() + 21'000 * ms, nullptr);
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
}

TEST(Flashing, GoesOnAfterAnInterruption) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  uint32_t held = 0;
  const UpdateResult stopped = bench.flash(
      newer_update,
      {.progress = [&](uint32_t now, uint32_t) { held = now; }, .stop_asked = [&] { return held > 20'000; }});
  EXPECT_EQ(stopped.end, UpdateEnd::stopped);
  EXPECT_GT(stopped.held_bytes, 20'000U);
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed") << "the firmware of before runs meanwhile";
  bench.power_cycle();
  const UpdateResult whole = bench.flash(newer_update);
  EXPECT_EQ(whole.end, UpdateEnd::confirmed);
  EXPECT_LT(whole.sent_bytes, whole.image_bytes - 20'000);
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
}

TEST(Flashing, ADryRunChangesNothing) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  ASSERT_EQ(bench.runs(), "0.1.0 confirmed");
  const BoardStatistics before = bench.board().statistics();
  EXPECT_EQ(before.flash_operations, 1U) << "the option bytes, once in a chip's life";
  EXPECT_EQ(before.resets.size(), 3U) << "for them, and the bootloader's two passes";
  EXPECT_EQ(bench.flash(newer_update, {.dry_run = true}).end, UpdateEnd::dry_run);
  EXPECT_EQ(bench.board().statistics().flash_operations, before.flash_operations);
  EXPECT_EQ(bench.board().statistics().resets.size(), before.resets.size());
}

TEST(Flashing, ADeadApplicationIsReplacedThroughTheWindowAfterAReset) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench(built + "tests/hanging.bin");  // nothing answers; the watchdog resets it each second
  EXPECT_EQ(bench.runs(), "silence");
  EXPECT_EQ(bench.flash(newer_update).end, UpdateEnd::confirmed);
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
}

TEST(Flashing, ABoardWithTheBootloaderAloneTakesItsFirstFirmware) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench(built + "bin/bootloader-stm32f405.bin");
  EXPECT_EQ(bench.runs(), "bootloader");
  const UpdateResult result = bench.flash(first_update);
  EXPECT_EQ(result.end, UpdateEnd::confirmed);
  EXPECT_FALSE(result.before.has_value());
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
}

TEST(Flashing, ACorruptedSlotIsNeverStarted) {
  NEEDS_UPDATE_IMAGES();
  FlashBench bench;
  (void)bench.flash(newer_update);  // slot B, confirmed; slot A still holds 0.1.0
  bench.board().power_off();
  const std::array<uint8_t, 4> zeros{};
  bench.board().load(zeros, 0x0804'1000);
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed") << "the one confirmed before";
  bench.board().load(zeros, 0x0802'1000);
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "bootloader");
}

}  // namespace
}  // namespace diastole::sim_board_test
