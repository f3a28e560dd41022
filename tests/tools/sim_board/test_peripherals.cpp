// The peripherals, each through an image that uses it as firmware does.

#include <gmock/gmock.h>

#include "tests/tools/sim_board/test_image.hpp"

namespace diastole {
namespace {

using namespace sim_board_test;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

constexpr SimBoard::Pin pa6{0, 6}, pa1{0, 1}, pb0{1, 0};

TEST(Peripherals, PllLocksAndTheClockTreeIsTrue) {
  BOARD_WITH(board, "pll");
  board.advance_to(5 * ms);
  EXPECT_EQ(seen(board, 0) & 0xfe00'0000U, 1U << 27 | 1U << 26 | 1U << 25) << "power-on flags";
  EXPECT_EQ(seen(board, 1) & 0xfU, 0xaU);
  EXPECT_EQ(seen(board, 2), 1U);
  const BoardStatistics found = board.statistics();
  EXPECT_EQ(found.core_Hz, 168'000'000U);
  EXPECT_THAT(found.notes, IsEmpty());
  const auto events = of_pin(board.take_pin_events(), pa1);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_NEAR(static_cast<double>(events[0].time_ns), 600e3, 50e3) << "crystal start and PLL lock";
}

void expect_exact_steps(SimBoard& board, uint64_t until_ns) {
  board.advance_to(until_ns);
  const auto edges = of_pin(board.take_pin_events(), pa6);
  ASSERT_GT(edges.size(), 1000U);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    ASSERT_EQ(edges[i].cycle - edges[i - 1].cycle, 2U * 84'000'000 / 60'000) << "edge " << i;
    ASSERT_NE(edges[i].value, edges[i - 1].value);
  }
  EXPECT_EQ(board.statistics().missed_deadlines, 0U);
}

TEST(Peripherals, CompareEdgesAreExactWhileAsleep) {
  BOARD_WITH(board, "steps");
  expect_exact_steps(board, 50 * ms);
}

TEST(Peripherals, CompareEdgesAreExactWhileBusy) {
  BOARD_WITH(board, "steps_busy");
  expect_exact_steps(board, 50 * ms);
}

TEST(Peripherals, RerunsAndOtherSlicesAreEqual) {
  BOARD_WITH(whole, "steps_busy");
  whole.advance_to(20 * ms);
  BOARD_WITH(sliced, "steps_busy");
  for (uint64_t t = 0; t < 20 * ms; t += 77'777)
    sliced.advance_to(t);
  sliced.advance_to(20 * ms);
  const auto a = whole.take_pin_events(), b = sliced.take_pin_events();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_EQ(a[i].cycle, b[i].cycle);
  EXPECT_EQ(seen(whole, 0), seen(sliced, 0));
}

TEST(Peripherals, UsartEchoesByInterruptAtItsBaudRate) {
  BOARD_WITH(board, "echo");
  board.advance_to(5 * ms);
  const std::vector<uint8_t> text{'h', 'a', 'l'};
  board.send(text);
  board.advance_to(10 * ms);
  const auto sent = board.take_sent();
  ASSERT_EQ(sent.size(), 3U);
  EXPECT_EQ(sent[0].value, 'i');
  EXPECT_EQ(sent[2].value, 'm');
  // Ten bits of 729 cycles of 84 MHz each way.
  EXPECT_NEAR(static_cast<double>(sent[0].time_ns - 5 * ms), 2 * 7290 / 0.084, 2e3);
  EXPECT_NEAR(static_cast<double>(sent[2].time_ns - sent[1].time_ns), 7290 / 0.084, 100);
  EXPECT_EQ(board.statistics().serial_overruns, 0U);
}

TEST(Peripherals, DacPlaysATriangleFromTimerTriggers) {
  BOARD_WITH(board, "triangle");
  board.advance_to(50 * ms);
  std::vector<SimBoard::PinEvent> codes;
  for (const auto& event : board.take_pin_events()) {
    if (event.dac == 1) codes.push_back(event);
  }
  ASSERT_EQ(codes.size(), 300U);
  EXPECT_EQ(codes[149].value, 3000U);
  EXPECT_EQ(codes[299].value, 0U);
  EXPECT_EQ(codes[299].time_ns - codes[0].time_ns, 29'900'000U);
}

TEST(Peripherals, FlashErasesProgramsAndRefuses) {
  BOARD_WITH(board, "flashing");
  std::vector<uint8_t> old(16, 0);
  board.load(old, flash_start + 0x8000);
  board.advance_to(400 * ms);
  EXPECT_EQ(seen(board, 5), 1U);
  EXPECT_EQ(seen(board, 0), 0xffff'ffffU);
  EXPECT_EQ(seen(board, 1), 0x1234'000fU);
  EXPECT_EQ(seen(board, 2) & 0x80, 0x80U) << "PGSERR";
  EXPECT_EQ(seen(board, 3) & 0x8000'0000U, 0x8000'0000U);
  EXPECT_EQ(seen(board, 4), 0x1234'0000U & 0x0f0f'0f0fU);
  EXPECT_EQ(board.word(flash_start + 0x8000 + 80), 0xffff'ffffU);
  EXPECT_EQ(board.statistics().flash_operations, 18U);
}

TEST(Peripherals, PowerCutLeavesTheOperationHalfDone) {
  BOARD_WITH(board, "flashing");
  board.cut_power_at_flash_operation(1);
  std::vector<uint8_t> old(0x4000, 0);
  board.load(old, flash_start + 0x8000);
  board.advance_to(400 * ms);
  EXPECT_FALSE(board.powered());
  EXPECT_LT(board.now_ns(), 100 * ms);
  EXPECT_EQ(board.word(flash_start + 0x8000), 0xffff'ffffU);
  EXPECT_EQ(board.word(flash_start + 0xbffc), 0U);
  board.cut_power_at_flash_operation(5);
  board.power_on();
  board.advance_to(board.now_ns() + 400 * ms);
  EXPECT_FALSE(board.powered());
  EXPECT_EQ(board.word(flash_start + 0x8000 + 8), 0x1234'0002U);
  EXPECT_NE(board.word(flash_start + 0x8000 + 12), 0x1234'0003U);
  EXPECT_NE(board.word(flash_start + 0x8000 + 12), 0xffff'ffffU);
  board.cut_power_at_flash_operation(std::nullopt);
  board.power_on();
  board.advance_to(board.now_ns() + 400 * ms);
  EXPECT_EQ(seen(board, 5), 1U);
}

TEST(Peripherals, ExtiCountsInjectedEdgesAtTheirTimes) {
  BOARD_WITH(board, "edges");
  for (uint64_t i = 0; i < 10; ++i) {
    board.drive(pb0, false, (10 + 2 * i) * ms);
    board.drive(pb0, true, (11 + 2 * i) * ms);
  }
  board.advance_to(9 * ms);
  EXPECT_TRUE(board.level(pb0)) << "pulled up";
  board.advance_to(40 * ms);
  EXPECT_EQ(seen(board, 0), 10U);
  const auto mirrored = of_pin(board.take_pin_events(), pa1);
  ASSERT_EQ(mirrored.size(), 2U);
  EXPECT_GT(mirrored[1].time_ns, 10 * ms);
  EXPECT_LT(mirrored[1].time_ns, 10 * ms + 5'000) << "within an interrupt's latency at 16 MHz";
}

TEST(Peripherals, ASoundImageLeavesNoNotes) {
  BOARD_WITH(board, "steps");
  board.advance_to(10 * ms);
  EXPECT_THAT(board.statistics().notes, IsEmpty());
}

}  // namespace
}  // namespace diastole
