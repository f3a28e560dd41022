#include "host/acquisition/slice_tracker.hpp"

#include <gmock/gmock.h>

namespace diastole {
namespace {

using Phase = SliceTracker::Phase;

Schedule two_slices(const std::string& prompt = "") {
  return {
      .dummy_cycles = 2, .pause_cycles = 1, .wait_cycles_at_most = 100, .blocks = {{"tagged", 2, 3, prompt}}};
}

/// One letter a cycle: d dummy, I the first imaged, i imaged, p pause, w waiting, L the study's last.
std::string cycles_of(SliceTracker& tracker, int cycles) {
  std::string letters;
  for (int i = 0; i < cycles; ++i) {
    const SliceTracker::Turn turn = tracker.on_trigger();
    if (turn.last_cycle) {
      letters += 'L';
    } else if (turn.slice_begins) {
      letters += 'I';
    } else {
      letters += phase_name(tracker.phase())[0];
    }
  }
  return letters;
}

TEST(SliceTracker, GoesThroughDummiesImagesAndPauses) {
  SliceTracker tracker(planned_slices(two_slices()));
  EXPECT_EQ(tracker.cycles_left(), 11);
  EXPECT_EQ(cycles_of(tracker, 11), "ddIiipddIiL");
  EXPECT_EQ(tracker.phase(), Phase::done);
  EXPECT_EQ(tracker.cycles_left(), 0);
  EXPECT_EQ(two_slices().cycles(), 11);
}

TEST(SliceTracker, CountsDownWithEveryCycle) {
  SliceTracker tracker(planned_slices(two_slices()));
  for (int64_t left = 10; left >= 0; --left) {
    (void)tracker.on_trigger();
    EXPECT_EQ(tracker.cycles_left(), left);
  }
}

TEST(SliceTracker, WaitsForTheOperatorBeforeEachSlice) {
  SliceTracker tracker(planned_slices(two_slices("ready?")));
  EXPECT_EQ(cycles_of(tracker, 3), "www");
  tracker.go_on(1);  // not the slice that is waited for
  EXPECT_EQ(cycles_of(tracker, 1), "w");
  tracker.go_on(0);
  EXPECT_EQ(cycles_of(tracker, 8), "ddIiipww");
  EXPECT_EQ(tracker.cycles_left(), 5);
  tracker.go_on(1);
  tracker.go_on(1);
  EXPECT_EQ(cycles_of(tracker, 5), "ddIiL");
}

TEST(SliceTracker, LeavesOutWhatIsDone) {
  Schedule schedule = two_slices();
  schedule.blocks.push_back({"flow", 1, 2, ""});
  schedule.done = {0, 2};
  EXPECT_EQ(schedule.cycles(), 5);
  SliceTracker tracker(planned_slices(schedule));
  EXPECT_EQ(tracker.slice(), 1U);
  EXPECT_EQ(tracker.slices(), 3U);
  EXPECT_EQ(tracker.cycles_left(), 5);
  EXPECT_EQ(cycles_of(tracker, 5), "ddIiL");
  EXPECT_EQ(tracker.cycles_left(), 0);

  schedule.done = {1};
  EXPECT_EQ(schedule.cycles(), 10);
  SliceTracker around(planned_slices(schedule));
  EXPECT_EQ(around.cycles_left(), 10);
  EXPECT_EQ(cycles_of(around, 10), "ddIiipddIL");
}

TEST(SliceTracker, OneCycleIsAStudy) {
  SliceTracker tracker(planned_slices({.blocks = {{"one", 1, 1, ""}}}));
  const SliceTracker::Turn turn = tracker.on_trigger();
  EXPECT_TRUE(turn.slice_begins);
  EXPECT_TRUE(turn.last_cycle);
}

}  // namespace
}  // namespace diastole
