#include "host/cli/session_view.hpp"

#include <gtest/gtest.h>

namespace diastole {
namespace {

SessionResult session(const std::string& end, int64_t cycles, int64_t triggers, int64_t gaps = 0) {
  return {.run = "a.run.h5",
          .end = end,
          .regular = end != "faulted",
          .cycles = cycles,
          .triggers = triggers,
          .samples = 1000,
          .gaps = gaps,
          .expected = 1000 + gaps};
}

TEST(SessionExitCode, AWholeSessionIsDone) {
  EXPECT_EQ(exit_code_of(session("completed", 10, 10)), ExitCode::done);
  EXPECT_EQ(exit_code_of(session("stopped_at_cycle_end", 4, 4)), ExitCode::done);
}

TEST(SessionExitCode, AStopWithinACycleHasTriggeredTheCycleItBroke) {
  EXPECT_EQ(exit_code_of(session("stopped_now", 3, 4)), ExitCode::done);
  EXPECT_EQ(exit_code_of(session("stopped_now", 3, 3)), ExitCode::done);
  EXPECT_EQ(exit_code_of(session("stopped_now", 0, 0)), ExitCode::done);
}

TEST(SessionExitCode, WhatIsMissingIsTold) {
  EXPECT_EQ(exit_code_of(session("completed", 10, 9)), ExitCode::negative);
  EXPECT_EQ(exit_code_of(session("completed", 10, 11)), ExitCode::negative);
  EXPECT_EQ(exit_code_of(session("stopped_at_cycle_end", 3, 4)), ExitCode::negative);
  EXPECT_EQ(exit_code_of(session("stopped_now", 3, 2)), ExitCode::negative);
  EXPECT_EQ(exit_code_of(session("stopped_now", 3, 5)), ExitCode::negative);
  EXPECT_EQ(exit_code_of(session("stopped_now", 3, 4, 1)), ExitCode::negative);
  EXPECT_EQ(exit_code_of(session("faulted", 3, 4)), ExitCode::hardware_fault);
}

}  // namespace
}  // namespace diastole
