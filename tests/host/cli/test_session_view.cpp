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

TEST(SessionExitCode, WitnessesThatDisagreeMakeTheAnswerNegative) {
  SessionResult result = session("completed", 10, 10);
  result.errors = 1;
  EXPECT_EQ(exit_code_of(result), ExitCode::negative);
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

SessionProgress study_progress() {
  return {.planned_s = 1531,
          .planned_cycles = 1276,
          .triggers = 420,
          .samples = 1000,
          .gaps = 2,
          .last_kPa = 3,
          .filtered_kPa = 3.12,
          .schedule = ScheduleProgress{"tagged", 10, 25, "imaging", 864, ""},
          .new_remarks = {}};
}

TEST(SessionView, ShowsCyclesSliceTimeLeftTraceAndTriggers) {
  const std::vector<std::string> lines = view_lines(study_progress(), {0, 1, 2, 4, 2, 1, 0});
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0], "[#######.................] cycle 412 of 1276, 17 min 17 s left, 420 triggers");
  EXPECT_EQ(lines[1], "slice 11 of 25 (tagged): imaging");
  EXPECT_EQ(lines[2], "▁▃▅█▅▃▁  3.12 kPa   1000 samples, 2 missing");
}

TEST(SessionView, ShowsWhatTheOperatorIsWaitedFor) {
  SessionProgress progress = study_progress();
  progress.schedule->phase = "waiting";
  progress.schedule->prompt = "Set the next slice.";
  EXPECT_EQ(view_lines(progress, {}).at(2), "Set the next slice.  [Enter, or `diastole continue`]");
}

TEST(SessionView, FitsTheTerminal) {
  const std::vector<std::string> lines = view_lines(study_progress(), {0, 1, 2, 4, 2, 1, 0}, 10);
  EXPECT_EQ(lines.at(0), "[#######..");
  EXPECT_EQ(lines.at(2), "▁▃▅█▅▃▁  3");
}

TEST(SessionView, BeforeTheFirstCycleItSaysSo) {
  SessionProgress progress = study_progress();
  progress.triggers = 0;
  progress.schedule->phase = "dummy";
  progress.filtered_kPa = -0.004;
  const std::vector<std::string> lines = view_lines(progress, {});
  EXPECT_EQ(lines.at(1), "slice 11 of 25 (tagged): at rest before the first cycle");
  EXPECT_EQ(lines.at(2), "  0.00 kPa   1000 samples, 2 missing");
}

TEST(SessionView, RestIsAFlatLine) {
  SessionProgress progress = study_progress();
  progress.schedule.reset();
  EXPECT_TRUE(view_lines(progress, {0.001, 0.003, -0.002}).at(1).starts_with("▁▁▁  "));
}

}  // namespace
}  // namespace diastole
