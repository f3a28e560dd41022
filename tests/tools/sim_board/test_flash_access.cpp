// Wait states, line by line: 16 bytes a line, five wait states, eight instructions a line.

#include "tools/sim_board/processor/flash_access.hpp"

#include <gtest/gtest.h>

namespace diastole::board_model {
namespace {

constexpr uint32_t five_wait_states = 5, prefetching = 1U << 8, caching = 3U << 9;

FlashAccess access_of(FlashTiming timing, uint32_t control) {
  FlashAccess access(timing);
  access.set_control(control);
  return access;
}

TEST(FlashAccess, WithoutCachesEveryLineAndEveryJumpWaits) {
  FlashAccess access = access_of(FlashTiming::misses, five_wait_states | prefetching | caching);
  EXPECT_EQ(access.block(0x100, 32, 16), 10U) << "two lines";
  EXPECT_EQ(access.block(0x100, 32, 16), 10U) << "again";
  EXPECT_EQ(access.block(0x120, 8, 4), 5U) << "goes on in the next line";
  EXPECT_EQ(access.block(0x128, 4, 2), 0U) << "goes on in the same";
  EXPECT_EQ(access.block(0x120, 4, 2), 5U) << "a jump within a line";
  EXPECT_EQ(access.read(0x100), 5U);
  EXPECT_EQ(access.read(0x100), 5U);
}

TEST(FlashAccess, ALoopWaitsOnceAndAPrefetchHidesWhatAnotherLineTakes) {
  FlashAccess access = access_of(FlashTiming::cached, five_wait_states | prefetching | caching);
  EXPECT_EQ(access.block(0x100, 32, 16), 5U) << "the second line comes while the first is executed";
  EXPECT_EQ(access.block(0x100, 32, 16), 0U);
  EXPECT_EQ(access.block(0x200, 32, 8), 6U) << "four instructions hide four of five cycles";
  EXPECT_EQ(access.read(0x300), 5U);
  EXPECT_EQ(access.read(0x30C), 0U);
  access.set_control(five_wait_states | caching);
  access.set_control(five_wait_states);
  EXPECT_EQ(access.block(0x100, 32, 16), 10U) << "the firmware has switched the caches off";
}

TEST(FlashAccess, SixtyFourLinesAreHeldAndTheOldestGoes) {
  FlashAccess access = access_of(FlashTiming::cached, five_wait_states | caching);
  for (uint32_t line = 0; line < 64; ++line)
    EXPECT_EQ(access.block(line * 32, 16, 8), 5U);
  EXPECT_EQ(access.block(0, 16, 8), 0U);
  EXPECT_EQ(access.block(64 * 32, 16, 8), 5U);
  EXPECT_EQ(access.block(0, 16, 8), 0U) << "used since";
  EXPECT_EQ(access.block(32, 16, 8), 5U) << "the one used longest ago";
}

}  // namespace
}  // namespace diastole::board_model
