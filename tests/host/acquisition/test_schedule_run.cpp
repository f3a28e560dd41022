// A study of slices on the desk: firmware, acquisition, journal, run file.

#include <gmock/gmock.h>

#include <algorithm>

#include "host/runfile/writer.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"
#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {
namespace {

std::string study(const std::string& schedule, const std::string& prompt) {
  return "format = \"diastole-experiment\"\nversion = 1\nrest_s = 0.1\n[[segment]]\nwaveform = "
         "\"parabolic\"\n"
         "stroke_mL = 10\nperiod_s = 0.5\n[schedule]\ndummy_cycles = 1\n" +
         schedule + "[[schedule.block]]\nname = \"tagged\"\nslices = 2\ncycles_per_slice = 3\n" + prompt;
}

int64_t prompts(const SessionOnDesk& session) {
  return std::ranges::count(session.remarks, "prompt", &RunRemark::code);
}

std::vector<int64_t> first_triggers(const runfile::RecordedRun& run) {
  std::vector<int64_t> rows;
  for (const runfile::Slice& slice : run.slices)
    rows.push_back(slice.first_trigger);
  return rows;
}

TEST(ScheduleRun, LabelsTheImagedCyclesAndEndsAsPlanned) {
  SessionOnDesk session(study("pause_cycles = 2\n", ""));
  session.run();
  EXPECT_EQ(session.outcome.end, "completed");
  write_run(session.scratch / "study.run.h5", session.assemble().run);
  const runfile::RecordedRun run = runfile::read_run(session.scratch / "study.run.h5");
  EXPECT_EQ(run.trigger_s.size(), 10U);
  EXPECT_THAT(first_triggers(run), testing::ElementsAre(1, 7));
  EXPECT_EQ(run.slices[1].block, "tagged");
  EXPECT_EQ(run.slices[1].number, 1);
  EXPECT_EQ(run.slices[1].triggers, 3);
  EXPECT_EQ(run.slices[1].dummy_cycles, 1);
  EXPECT_THAT(runfile::assess(run).problems, testing::IsEmpty());
  EXPECT_EQ(runfile::bin_frames(run, {.frames = 8}).frames[0].cycles, 6U);
  EXPECT_EQ(runfile::bin_frames(run, {.frames = 8, .slice = 1}).frames[0].cycles, 3U);
}

TEST(ScheduleRun, WaitsForTheOperatorWhileThePumpGoesOn) {
  SessionOnDesk session(study("wait_cycles_at_most = 50\n", "prompt = \"Set slice\"\n"));
  session.go_on = [&, questions = 0]() mutable -> std::optional<size_t> {
    if (++questions % 800 != 0) return std::nullopt;  // a few cycles later
    return static_cast<size_t>(prompts(session) - 1);
  };
  session.run();
  EXPECT_EQ(session.outcome.end, "completed");
  EXPECT_EQ(prompts(session), 2);
  const runfile::RecordedRun run = session.assemble().run;
  ASSERT_EQ(run.slices.size(), 2U);
  EXPECT_GT(run.slices[0].first_trigger, 2);
  EXPECT_GT(run.slices[1].first_trigger, run.slices[0].first_trigger + 4);
  EXPECT_LT(run.trigger_s.size(), 50U);
  EXPECT_EQ(run.segments[0].cycles, std::ssize(run.trigger_s));
  EXPECT_EQ(run.slices[1].first_trigger + 3, std::ssize(run.trigger_s));
  EXPECT_THAT(runfile::assess(run).problems, testing::IsEmpty());
}

TEST(ScheduleRun, AWaitThatIsTooLongEndsInAFault) {
  SessionOnDesk session(study("wait_cycles_at_most = 4\n", "prompt = \"Set slice\"\n"));
  session.run();
  const runfile::RecordedRun run = session.assemble().run;
  EXPECT_TRUE(run.slices.empty());
  EXPECT_THAT(runfile::assess(run).problems,
              testing::Contains(testing::HasSubstr("slice 1 of 2 was not imaged")));
}

TEST(ScheduleRun, AStopWithinASliceKeepsWhatItHas) {
  SessionOnDesk session(study("", ""));
  session.run([&] {
    return std::ranges::count(session.remarks, "slice", &RunRemark::code) == 2 ? StopRequest::at_cycle_end
                                                                               : StopRequest::none;
  });
  EXPECT_EQ(session.outcome.end, "stopped_at_cycle_end");
  const runfile::RecordedRun run = session.assemble().run;
  ASSERT_EQ(run.slices.size(), 2U);
  EXPECT_LT(run.slices[1].triggers, 3);
  EXPECT_TRUE(runfile::assess(run).stopped_on_request);
  EXPECT_NO_THROW(runfile::check(run));
}

/// What follows the trigger of the last imaged cycle, the eighth.
class StopInTheLastCycle : public testing::TestWithParam<int> {};

TEST_P(StopInTheLastCycle, LeavesACompleteStudy) {
  SessionOnDesk session(study("", ""));
  uint64_t last_trigger_ns = 0;
  session.run([&] {
    if (last_trigger_ns == 0 && session.client.last_known().triggers == 8)
      last_trigger_ns = session.desk.now_ns;
    const bool due = last_trigger_ns != 0 &&
                     session.desk.now_ns >= last_trigger_ns + static_cast<uint64_t>(1'000'000 * GetParam());
    return due ? StopRequest::at_cycle_end : StopRequest::none;
  });
  EXPECT_EQ(session.outcome.end, "completed");
  EXPECT_EQ(std::ranges::count(session.remarks, "error", &RunRemark::level), 0);
  const runfile::RecordedRun run = session.assemble().run;
  EXPECT_EQ(run.trigger_s.size(), 8U);
  EXPECT_THAT(runfile::assess(run).problems, testing::IsEmpty());
}

// 0: with the trigger; 700: the pump is at rest, and the last samples are being taken
INSTANTIATE_TEST_SUITE_P(ScheduleRun, StopInTheLastCycle, testing::Values(0, 1, 10, 250, 480, 700));

TEST(ScheduleRun, AStopJustBeforeTheLastTriggerIsSentOnceAndRefusedNever) {
  for (const int64_t before_ms : {1, 2, 4, 8, 15, 30}) {
    SCOPED_TRACE(before_ms);
    uint64_t seventh_ns = 0;
    SessionOnDesk session(study("", ""));
    session.run([&] {
      if (seventh_ns == 0 && session.client.last_known().triggers == 7) seventh_ns = session.desk.now_ns;
      const bool due =
          seventh_ns != 0 &&
          session.desk.now_ns >= seventh_ns + 500'000'000 - static_cast<uint64_t>(1'000'000 * before_ms);
      return due ? StopRequest::at_cycle_end : StopRequest::none;
    });
    EXPECT_TRUE(session.outcome.regular()) << session.outcome.end;
    EXPECT_EQ(session.outcome.end == "completed", session.outcome.counts.triggers == 8);
    EXPECT_EQ(std::ranges::count(session.remarks, "error", &RunRemark::level), 0);
    EXPECT_EQ(std::ranges::count(session.remarks, "stop", &RunRemark::code), 1);
    EXPECT_THAT(runfile::assess(session.assemble().run).problems, testing::IsEmpty());
  }
}

TEST(ScheduleRun, AStopNowInTheLastCycleIsSent) {
  SessionOnDesk session(study("", ""));
  session.run(
      [&] { return session.client.last_known().triggers == 8 ? StopRequest::now : StopRequest::none; });
  EXPECT_EQ(session.outcome.end, "stopped_now");
  EXPECT_LT(session.outcome.cycles, 8U);
}

}  // namespace
}  // namespace diastole
