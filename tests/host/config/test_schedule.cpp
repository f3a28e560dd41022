#include "host/config/schedule.hpp"

#include <gmock/gmock.h>

#include "host/config/experiment.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Experiment study(const std::string& schedule, const std::string& segment = "") {
  return parse_experiment(
      "format = \"diastole-experiment\"\nversion = 1\n[[segment]]\nwaveform = \"parabolic\"\n"
      "stroke_mL = 40\nperiod_s = 1.2\n" +
          segment + "[schedule]\n" + schedule,
      "study.experiment.toml");
}

std::string refusal(const std::string& schedule, const std::string& segment = "") {
  return message_of<InputError>([&] { (void)study(schedule, segment); });
}

TEST(Schedule, OfThePapersStudyHasItsCyclesAndMinutes) {
  const Experiment experiment =
      read_experiment(std::string(DIASTOLE_SOURCE_DIR) + "/examples/study.experiment.toml");
  ASSERT_TRUE(experiment.schedule);
  EXPECT_EQ(experiment.planned_cycles(), 456 + 312 + 512);
  EXPECT_EQ(experiment.schedule->blocks[0].cycles_per_slice, 38);
  EXPECT_EQ(experiment.schedule->slices(), 25);
  EXPECT_NEAR(experiment.estimate_s() / 60, 26, 0.5);
  EXPECT_EQ(experiment.segments.front().cycles, 1280 + 3000);
}

TEST(Schedule, WithoutPromptsReservesNoCycles) {
  const Experiment experiment = study(
      "dummy_cycles = 3\npause_cycles = 5\n[[schedule.block]]\nname = \"a\"\nslices = 2\ncycles_per_slice = "
      "4\n");
  EXPECT_FALSE(experiment.schedule->waits());
  EXPECT_EQ(experiment.cycles(), 2 * (3 + 4) + 5);
  EXPECT_EQ(experiment.planned_cycles(), experiment.cycles());
}

TEST(Schedule, WithoutWhatIsDoneReservesTheRest) {
  Experiment experiment = study(
      "dummy_cycles = 3\npause_cycles = 5\nwait_cycles_at_most = 100\n[[schedule.block]]\nname = "
      "\"a\"\nslices = "
      "2\ncycles_per_slice = 4\nprompt = \"Set it.\"\n[[schedule.block]]\nname = \"b\"\ncycles_per_slice = "
      "9\n");
  EXPECT_EQ(experiment.cycles(), 2 * (3 + 4) + (3 + 9) + 2 * 5 + 100);
  leave_out(experiment, {0});
  EXPECT_EQ(experiment.cycles(), (3 + 4) + (3 + 9) + 5 + 100);
  leave_out(experiment, {0, 1});
  EXPECT_FALSE(experiment.schedule->waits());
  EXPECT_EQ(experiment.cycles(), 3 + 9);
  EXPECT_EQ(experiment.planned_cycles(), 3 + 9);
}

TEST(Schedule, LongerThanTheCycleIsRefused) {
  const std::string frames =
      "[[schedule.block]]\nname = \"a\"\ncycles_per_slice = 38\nframes = 16\ntr_ms = 188\n";
  EXPECT_THAT(refusal(frames), AllOf(HasSubstr("3.008 s after the trigger"), HasSubstr("every 1.2 s")));
  EXPECT_THAT(refusal(frames + "gate_every = 2\n"), HasSubstr("every 2.4 s"));
  EXPECT_EQ(refusal(frames + "gate_every = 3\n"), "(no error)");
}

TEST(Schedule, WhatHasNoSenseIsRefusedWithItsPlace) {
  const std::string block = "[[schedule.block]]\nname = \"a\"\ncycles_per_slice = 38\n";
  EXPECT_THAT(refusal(""), HasSubstr("schedule.block"));
  EXPECT_THAT(refusal("[[schedule.block]]\nname = \"a\"\n"), HasSubstr("cycles_per_slice"));
  EXPECT_THAT(refusal(block + "lines = 128\n"), HasSubstr("given beside lines"));
  EXPECT_THAT(refusal(block + "slice = 2\n"), HasSubstr("slices"));
  EXPECT_THAT(refusal(block, "cycles = 7\n"), HasSubstr("without cycles"));
  EXPECT_THAT(refusal("dummy_cycles = -1\n" + block), HasSubstr("dummy_cycles"));
}

}  // namespace
}  // namespace diastole
