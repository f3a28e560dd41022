// Triggers against the schedule, and what inspect says of them.

#include "protocol/runfile/cycles.hpp"

#include <gmock/gmock.h>

#include "protocol/runfile/soundness.hpp"

namespace diastole::runfile {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// Ten cycles of 1 s from 1 s on, each triggered 4 ms after it began, sampled at 100 Hz.
RecordedRun ten_cycles() {
  RecordedRun run;
  run.segments = {{1, "parabolic", 10, 1, 0, 10}};
  for (int i = 0; i < 10; ++i)
    run.trigger_s.push_back(1.004 + i);
  for (int i = 0; i < 1200; ++i) {
    run.pressure.time_s.push_back(0.01 * i);
    run.pressure.channels["cavity_kPa"].push_back(i % 2 == 0 ? 1 : 1.01);
  }
  run.pump.time_s = run.pressure.time_s;
  run.pump.commanded_mL = run.pressure.channels["cavity_kPa"];
  return run;
}

void erase_trigger(RecordedRun& run, std::ptrdiff_t row) { run.trigger_s.erase(run.trigger_s.begin() + row); }

struct Counts {
  int64_t missing, extra, non_periodic;
  bool operator==(const Counts&) const = default;
};

Counts counts_of(const RecordedRun& run) {
  const SegmentTriggers found = triggers_of(run, 0);
  return {found.count(TriggerFault::missing), found.count(TriggerFault::extra),
          found.count(TriggerFault::non_periodic)};
}

TEST(Cycles, DelayedTriggersBelongToTheCyclesThatBeganBeforeThem) {
  RecordedRun run = ten_cycles();
  run.trigger_delay_s = 0.9;
  for (double& trigger_s : run.trigger_s)
    trigger_s += run.trigger_delay_s;
  EXPECT_EQ(counts_of(run), (Counts{0, 0, 0}));
  const SegmentTriggers found = triggers_of(run, 0);
  ASSERT_EQ(found.triggers.size(), 10U);
  for (size_t i = 0; i < 10; ++i)
    EXPECT_EQ(found.triggers[i].cycle, static_cast<int64_t>(i));
  EXPECT_TRUE(assess(run).sound());
  run.trigger_delay_s = 0;
  EXPECT_FALSE(assess(run).sound()) << "the delay must be known";
}

TEST(Cycles, OnTimeHaveNoFaultAndAreNumbered) {
  const SegmentTriggers found = triggers_of(ten_cycles(), 0);
  ASSERT_EQ(found.triggers.size(), 10U);
  EXPECT_THAT(found.remarks, IsEmpty());
  for (size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(found.triggers[i].cycle, static_cast<int64_t>(i));
    EXPECT_EQ(found.triggers[i].fault, "");
  }
  EXPECT_TRUE(assess(ten_cycles()).sound());
}

TEST(Cycles, MissingTriggersAreCountedWhereverTheyAre) {
  for (const std::ptrdiff_t row : {0, 4, 9}) {
    RecordedRun run = ten_cycles();
    erase_trigger(run, row);
    EXPECT_EQ(counts_of(run), (Counts{1, 0, 0})) << row;
    EXPECT_EQ(triggers_of(run, 0).triggers.back().cycle, row == 9 ? 8 : 9);
    EXPECT_THAT(assess(run).problems, Contains(HasSubstr("1 trigger is missing"))) << row;
  }
  RecordedRun run = ten_cycles();
  erase_trigger(run, 5);
  erase_trigger(run, 5);
  EXPECT_EQ(counts_of(run), (Counts{2, 0, 0}));
  EXPECT_THAT(assess(run).problems, Contains(HasSubstr("2 triggers are missing after the one at 5.004 s")));
  EXPECT_THAT(triggers_of(run, 0).triggers[4].fault, HasSubstr("3.0000 s"));
}

TEST(Cycles, AnExtraTriggerIsNoNewCycle) {
  RecordedRun run = ten_cycles();
  run.trigger_s.insert(run.trigger_s.begin() + 3, 3.5);
  EXPECT_EQ(counts_of(run), (Counts{0, 1, 0}));
  const SegmentTriggers found = triggers_of(run, 0);
  EXPECT_EQ(found.triggers[3].cycle, 2);
  EXPECT_EQ(found.triggers.back().cycle, 9);
  EXPECT_THAT(found.triggers[2].fault, HasSubstr("extra trigger came 0.4960 s"));
  EXPECT_THAT(assess(run).problems, Contains(HasSubstr("trigger 3 at 3.500 s is extra")));
}

TEST(Cycles, ATriggerOutOfTimeIsNonPeriodicAndTheCountGoesOnFromIt) {
  RecordedRun run = ten_cycles();
  for (size_t i = 6; i < 10; ++i)
    run.trigger_s[i] += 0.02;
  EXPECT_EQ(counts_of(run), (Counts{0, 0, 1}));
  EXPECT_THAT(assess(run).problems, Contains(HasSubstr("comes 1.0200 s after the one before, not 1.0000 s")));
}

TEST(Cycles, ATriggerInTheRestIsOutsideEverySegment) {
  RecordedRun run = ten_cycles();
  run.trigger_s.insert(run.trigger_s.begin(), 0.3);
  EXPECT_THAT(triggers_outside(run), testing::ElementsAre(0));
  EXPECT_EQ(assess(run).triggers.extra, 1);
  EXPECT_THAT(assess(run).problems, Contains(HasSubstr("trigger 0: at 0.300 s, outside every segment")));
}

TEST(Cycles, AStopOnRequestMissesNoneAtTheEndButStillThoseBefore) {
  RecordedRun run = ten_cycles();
  run.trigger_s.resize(6);
  EXPECT_EQ(counts_of(run), (Counts{4, 0, 0}));
  run.events = {{7, "info", "stopped_at_cycle_end", "stopped on request after 6 cycles"}};
  EXPECT_EQ(counts_of(run), (Counts{0, 0, 0}));
  EXPECT_TRUE(assess(run).sound());
  erase_trigger(run, 2);
  EXPECT_EQ(counts_of(run), (Counts{1, 0, 0}));
}

TEST(Cycles, ManyFaultsAreToldByTheirFirstAndTheirNumber) {
  RecordedRun run = ten_cycles();
  for (size_t i = 1; i < 10; ++i)
    run.trigger_s[i] += 0.02 * static_cast<double>(i);
  const Soundness soundness = assess(run);
  EXPECT_EQ(soundness.triggers.non_periodic, 9);
  EXPECT_THAT(soundness.problems, Contains(HasSubstr("and 4 more")));
}

TEST(Soundness, AClockThatCannotBeIsAFault) {
  RecordedRun run = ten_cycles();
  run.clock = {{"host_drift_ppm", 40}, {"daq_drift_ppm", -80}};
  EXPECT_TRUE(assess(run).sound());
  run.clock["daq_drift_ppm"] = -2400;
  EXPECT_THAT(assess(run).problems, Contains(HasSubstr("daq_drift_ppm is -2400")));
}

TEST(Soundness, ASliceWithoutAllItsCyclesIsAFaultUnlessSomebodyStopped) {
  RecordedRun run = ten_cycles();
  run.slices = {{"tagged", 0, 2, 3, 3, 2}, {"tagged", 1, 7, 3, 3, 2}};
  EXPECT_TRUE(assess(run).sound());
  run.slices[1].triggers = 1;
  EXPECT_THAT(assess(run).problems, Contains(HasSubstr("slice 1 of tagged: 1 of its 3 cycles")));
  run.events = {{7, "info", "stopped_now", "stopped on request"}};
  EXPECT_TRUE(assess(run).sound());
}

}  // namespace
}  // namespace diastole::runfile
