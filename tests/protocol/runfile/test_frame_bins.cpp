#include "protocol/runfile/frame_bins.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "protocol/contract/input_error.hpp"

namespace diastole::runfile {
namespace {

using testing::HasSubstr;

/// Two cycles of 1 s after 1 s of rest, ten samples a second; cycle i reads 10 i + phase tenth.
RecordedRun staircase() {
  RecordedRun run;
  run.file = "staircase.run.h5";
  run.segments = {{0, "hold", 0, 1, 0, 1}, {1, "parabolic", 10, 1, 0, 2}};
  run.trigger_s = {1, 2};
  for (int i = 0; i < 31; ++i) {
    run.pressure.time_s.push_back(0.1 * i);
    run.pressure.channels["cavity_kPa"].push_back(i < 10 ? 0 : 10 * (i / 10 - 1) + i % 10);
  }
  return run;
}

std::string refusal(const RecordedRun& run, const FrameBinOptions& options) {
  try {
    (void)bin_frames(run, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "(accepted)";
}

TEST(FrameBins, MatchTheHandCalculation) {
  const FrameBins bins = bin_frames(staircase(), {.frames = 2});
  EXPECT_EQ(bins.segment, 1U);
  EXPECT_EQ(bins.triggers, 2U);
  EXPECT_TRUE(bins.excluded.empty());
  ASSERT_EQ(bins.frames.size(), 2U);
  // Frame 0: cycle means 2 and 12; frame 1: 7 and 17.
  EXPECT_DOUBLE_EQ(bins.frames[0].mean_kPa, 7);
  EXPECT_DOUBLE_EQ(bins.frames[1].mean_kPa, 12);
  EXPECT_DOUBLE_EQ(bins.frames[0].sd_kPa, 10 / std::sqrt(2));
  EXPECT_DOUBLE_EQ(bins.frames[0].drift_kPa_per_cycle, 10);
  EXPECT_EQ(bins.frames[0].cycles, 2U);
  EXPECT_EQ(bins.frames[0].samples, 10U);
  // Samples 0..4 and 10..14 about 7: 2 (5 * 25 + 10) / 9.
  EXPECT_NEAR(bins.frames[0].sample_sd_kPa, std::sqrt(270.0 / 9), 1e-12);
}

TEST(FrameBins, WindowsCountFromTheTrueTrigger) {
  RecordedRun run = staircase();
  run.trigger_s = {1.002, 2.002};  // the samples at 1.0 and 2.0 now precede their trigger
  run.segments[1].start_s = 1.002;
  const FrameBins bins = bin_frames(run, {.windows = {{0.05, 0.15}}});
  EXPECT_DOUBLE_EQ(bins.frames[0].mean_kPa, 6);  // samples 1.1 and 2.1: 1 and 11
}

TEST(FrameBins, ACycleWithAMissingSampleIsExcludedAndTold) {
  RecordedRun run = staircase();
  run.pressure.channels["cavity_kPa"][13] = std::nan("");
  run.gaps = {{"pressure", 13, 1, "stall"}};
  const FrameBins bins = bin_frames(run, {.frames = 2});
  ASSERT_EQ(bins.excluded.size(), 1U);
  EXPECT_EQ(bins.excluded[0].cycle, 0U);
  EXPECT_THAT(bins.excluded[0].reason, HasSubstr("sample 13 is missing"));
  EXPECT_DOUBLE_EQ(bins.frames[0].mean_kPa, 12);
  EXPECT_DOUBLE_EQ(bins.frames[0].sd_kPa, 0);
}

TEST(FrameBins, AWildCycleIsLeftOutIfThatIsAskedFor) {
  RecordedRun run;
  run.segments = {{0, "parabolic", 10, 1, 0, 6}};
  for (int i = 0; i < 61; ++i) {
    const int cycle = i / 10;
    if (i % 10 == 0 && cycle < 6) run.trigger_s.push_back(cycle);
    run.pressure.time_s.push_back(0.1 * i);
    // Cycles scatter by 0.1 kPa or so; the fifth is beside them in its second half.
    run.pressure.channels["cavity_kPa"].push_back(i % 10 + 0.1 * (cycle % 3) + (i >= 45 && i < 50 ? 40 : 0));
  }
  const FrameBins plain = bin_frames(run, {.frames = 2});
  EXPECT_EQ(plain.frames[1].cycles, 6U);
  EXPECT_GT(plain.frames[1].sd_kPa, 10);
  const FrameBins bins = bin_frames(run, {.frames = 2, .without_outliers = true});
  EXPECT_EQ(bins.frames[1].cycles, 5U);
  EXPECT_LT(bins.frames[1].sd_kPa, 0.2);
  ASSERT_EQ(bins.outliers.size(), 1U);
  EXPECT_EQ(bins.outliers[0].cycle, 4U);
  EXPECT_DOUBLE_EQ(bins.outliers[0].trigger_s, 4);
  EXPECT_THAT(bins.outliers[0].reason, HasSubstr("from the middle cycle"));
  EXPECT_TRUE(bins.excluded.empty());

  run.segments.front().cycles = 4;
  run.trigger_s.resize(4);
  run.pressure.channels["cavity_kPa"][20] = 1000;
  EXPECT_TRUE(bin_frames(run, {.frames = 2, .without_outliers = true}).outliers.empty());
}

TEST(FrameBins, AHoleInTheTimesExcludesItsCycle) {
  RecordedRun run = staircase();
  run.pressure.time_s.erase(run.pressure.time_s.begin() + 25);
  run.pressure.channels["cavity_kPa"].erase(run.pressure.channels["cavity_kPa"].begin() + 25);
  const FrameBins bins = bin_frames(run, {.frames = 2});
  ASSERT_EQ(bins.excluded.size(), 1U);
  EXPECT_THAT(bins.excluded[0].reason, HasSubstr("without a sample"));
}

TEST(FrameBins, AnIrregularTriggerExcludesTheCycleBeforeIt) {
  RecordedRun run = staircase();
  run.trigger_s = {1, 1.6, 2};
  const FrameBins bins = bin_frames(run, {.frames = 2});
  EXPECT_EQ(bins.triggers, 3U);
  EXPECT_EQ(bins.scheduled_cycles, 2);
  ASSERT_EQ(bins.excluded.size(), 2U);
  EXPECT_THAT(bins.excluded[0].reason, HasSubstr("0.6000 s"));
}

TEST(FrameBins, ARecordingThatEndsWithinACycleLosesThatCycle) {
  RecordedRun run = staircase();
  run.pressure.time_s.resize(25);
  run.pressure.channels["cavity_kPa"].resize(25);
  const FrameBins bins = bin_frames(run, {.frames = 2});
  ASSERT_EQ(bins.excluded.size(), 1U);
  EXPECT_THAT(bins.excluded[0].reason, HasSubstr("ends within it"));
}

TEST(FrameBins, ImpossibleRequestsAreRefusedInWords) {
  EXPECT_THAT(refusal(staircase(), {.segment = 7}), HasSubstr("segment 7"));
  EXPECT_THAT(refusal(staircase(), {.segment = 0}), HasSubstr("has no trigger"));
  EXPECT_THAT(refusal(staircase(), {.channel = "pump_kPa"}), HasSubstr("/pressure/pump_kPa"));
  EXPECT_THAT(refusal(staircase(), {.windows = {{0.5, 1.2}}}), HasSubstr("outside the cycle"));
  EXPECT_THAT(refusal(staircase(), {.frames = 0}), HasSubstr("at least one frame"));
  EXPECT_THAT(refusal(staircase(), {.frames = 40}), HasSubstr("no sample falls into frame"));
  EXPECT_THAT(refusal(staircase(), {.frames = 40}), HasSubstr("Ask for fewer frames"));
}

TEST(FrameBins, ALateSampleIsNoHole) {
  RecordedRun run = staircase();
  run.pressure.time_s[12] += 0.08;
  run.pressure.time_s[13] += 0.02;
  EXPECT_TRUE(bin_frames(run, {.frames = 2}).excluded.empty());
}

}  // namespace
}  // namespace diastole::runfile
