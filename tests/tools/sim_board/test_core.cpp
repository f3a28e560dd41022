// The core: exceptions, priorities, faults, floating point, sleep, resets.

#include <gmock/gmock.h>

#include "tests/tools/sim_board/test_image.hpp"

namespace diastole {
namespace {

using namespace sim_board_test;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Core, PreemptionTailChainingAndMasks) {
  BOARD_WITH(board, "nesting");
  board.advance_to(2 * ms);
  std::vector<uint32_t> marks;
  for (uint32_t i = 0; i < seen(board, 0); ++i)
    marks.push_back(seen(board, 1 + i));
  EXPECT_THAT(marks, ElementsAre(10, 20, 21, 11, 30, 31, 39, 40, 49, 50, 99));
}

TEST(Core, SysTickSupervisorCallAndPendSV) {
  BOARD_WITH(board, "ticks");
  board.advance_to(100 * ms);
  EXPECT_EQ(seen(board, 0), 99U);
  EXPECT_EQ(seen(board, 1), 1U);
  EXPECT_EQ(seen(board, 2), 99U);
}

TEST(Core, FloatRegistersSurviveInterrupts) {
  BOARD_WITH(board, "floats");
  board.advance_to(200 * ms);
  ASSERT_EQ(seen(board, 2), 1U) << board.statistics().last_fault;
  EXPECT_GT(seen(board, 1), 500U) << "interrupts that use floats";
  volatile float sum = 0.0F, term = 1.0F, other = 3.0F;
  for (int i = 0; i < 20000; ++i) {
    sum = sum + term * other;
    term = term * 0.5F + 0.125F;
    other = other * 0.25F + 1.5F;
  }
  const float board_sum = std::bit_cast<float>(seen(board, 0));
  EXPECT_NEAR(board_sum, sum, 0.1F) << "fused multiply-add on the board rounds less often";
  EXPECT_EQ(seen(board, 3) & 4, 4U) << "CONTROL.FPCA";
}

TEST(Core, FlagsSurviveInterrupts) {
  BOARD_WITH(board, "carries");
  board.advance_to(200 * ms);
  ASSERT_EQ(seen(board, 2), 1U);
  EXPECT_GT(seen(board, 0), 1'000U) << "interrupts";
  EXPECT_EQ(seen(board, 1), 0U) << "carries lost";
}

TEST(Core, FloatBeforeTheFpuIsEnabledFaults) {
  BOARD_WITH(board, "early_float");
  board.advance_to(ms);
  EXPECT_EQ(seen(board, 0), 1U) << "what comes before it in the same block is executed";
  EXPECT_EQ(seen(board, 1), 1U << 19) << "CFSR.NOCP";
  EXPECT_EQ(seen(board, 2), 1U << 30) << "HFSR.FORCED";
  EXPECT_EQ(seen(board, 3), 0U);
  EXPECT_THAT(board.statistics().last_fault, HasSubstr("CPACR"));
}

TEST(Core, BadAccessEscalatesToHardFault) {
  BOARD_WITH(board, "bad_access");
  board.advance_to(ms);
  EXPECT_EQ(seen(board, 0), 1U);
  EXPECT_EQ(seen(board, 1), 1U << 9 | 1U << 15) << "CFSR.PRECISERR, BFARVALID";
  EXPECT_EQ(seen(board, 2), 1U << 30);
  EXPECT_EQ(seen(board, 3), 0x3000'0000U) << "BFAR";
  EXPECT_EQ(seen(board, 4), 3U) << "IPSR";
  EXPECT_EQ(seen(board, 6), 0U);
}

TEST(Core, EnabledBusFaultIsTakenItself) {
  BOARD_WITH(board, "bus_fault");
  board.advance_to(ms);
  EXPECT_EQ(seen(board, 4), 5U);
  EXPECT_EQ(seen(board, 2), 0U);
}

TEST(Core, FaultInTheFaultHandlerLocksUp) {
  BOARD_WITH(board, "double_fault");
  board.advance_to(ms);
  EXPECT_TRUE(board.statistics().locked_up);
  EXPECT_EQ(board.now_ns(), ms) << "time goes on for a watchdog";
}

TEST(Core, SoftwareAndWatchdogResetsTellTheirCause) {
  BOARD_WITH(board, "resets");
  board.advance_to(50 * ms);
  EXPECT_EQ(seen(board, 8), 2U);
  EXPECT_EQ(seen(board, 9) & 0xfe00'0000U, 1U << 28 | 1U << 26) << "RCC_CSR.SFTRSTF, PINRSTF";
  board.advance_to(300 * ms);
  EXPECT_EQ(seen(board, 8), 3U);
  EXPECT_EQ(seen(board, 9) & 0xfe00'0000U, 1U << 29 | 1U << 26) << "RCC_CSR.IWDGRSTF, PINRSTF";
  const auto resets = board.statistics().resets;
  ASSERT_EQ(resets.size(), 3U);
  EXPECT_EQ(resets[1].cause, "software");
  EXPECT_EQ(resets[2].cause, "watchdog");
  EXPECT_NEAR(static_cast<double>(resets[2].time_ns - resets[1].time_ns), 100.0 * ms, 0.1 * ms);
}

TEST(Core, StackUseAndInterruptCostsAreMeasured) {
  BOARD_WITH(board, "steps");
  board.advance_to(20 * ms);
  const BoardStatistics found = board.statistics();
  EXPECT_EQ(found.stack_top, 0x2002'0000U);
  EXPECT_GE(found.stack_used_bytes, 32U);
  EXPECT_LT(found.stack_used_bytes, 200U);
  ASSERT_EQ(found.interrupts.size(), 1U);
  EXPECT_EQ(found.interrupts[0].irq, 29U);
  EXPECT_GT(found.interrupts[0].count, 1000U);
  EXPECT_GE(found.interrupts[0].worst_instructions, 8U);
  EXPECT_LT(found.interrupts[0].worst_instructions, 20U);
}

}  // namespace
}  // namespace diastole
