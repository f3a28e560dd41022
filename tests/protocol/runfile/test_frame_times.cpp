// The scanner's own frame windows: their file, gating, delay, slices.

#include "protocol/runfile/frame_times.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/signal_delay.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::runfile {
namespace {

using testing::HasSubstr;

constexpr double period_s = 1.2;

/// Six cycles of 1.2 s after 1 s; cycle i reads sin(2 pi t / 1.2) + 0.1 i, as late as `delay_s`.
RecordedRun waves(double delay_s = 0) {
  RecordedRun run;
  run.file = "waves.run.h5";
  run.segments = {{1, "sinusoidal", 40, period_s, 0, 6}};
  for (int i = 0; i < 6; ++i)
    run.trigger_s.push_back(1 + period_s * i);
  for (int i = 0; i < 2800; ++i) {
    const double t = i / 300.0;
    const double since_s = t - delay_s - 1;
    run.pressure.time_s.push_back(t);
    run.pressure.channels["cavity_kPa"].push_back(std::sin(2 * std::numbers::pi * since_s / period_s) +
                                                  0.1 * std::floor(since_s / period_s));
  }
  return run;
}

std::string refusal_of_list(const std::string& text) {
  return message_of<InputError>([&] { (void)parse_frame_times(text, "times.csv"); });
}

TEST(FrameTimes, AreReadByTheirColumnsNames) {
  const auto starts =
      parse_frame_times("slice, trigger_time_ms ,frame,width_ms\n1,10,0,50\n1,70.5,1,52\n", "t");
  ASSERT_EQ(starts.size(), 2U);
  EXPECT_DOUBLE_EQ(starts[1].from_s, 0.0705);
  EXPECT_DOUBLE_EQ(*starts[1].width_s, 0.052);
}

TEST(FrameTimes, WithoutWidthReachToTheNextFrameAndNeverBeyondTheCycle) {
  const auto starts = parse_frame_times("trigger_time_ms\n10\n70\r\n1100\n\n", "t");
  const auto windows = windows_of(starts, {}, period_s);
  ASSERT_EQ(windows.size(), 3U);
  EXPECT_DOUBLE_EQ(windows[0].to_s, 0.07);
  EXPECT_DOUBLE_EQ(windows[2].to_s, 1.2);
  EXPECT_DOUBLE_EQ(windows_of(starts, 0.02, period_s)[2].to_s, 1.12);
}

TEST(FrameTimes, FaultsAreToldWithLineAndColumn) {
  EXPECT_THAT(refusal_of_list("frame,time\n0,1\n"), HasSubstr("line 1: names no column trigger_time_ms"));
  EXPECT_THAT(refusal_of_list("trigger_time_ms\n10\nten\n"), HasSubstr("line 3, column trigger_time_ms"));
  EXPECT_THAT(refusal_of_list("trigger_time_ms\n10\nnan\n"), HasSubstr("is not a number"));
  EXPECT_THAT(refusal_of_list("trigger_time_ms\n10\n5\n"), HasSubstr("does not follow"));
  EXPECT_THAT(refusal_of_list("trigger_time_ms,width_ms\n10,0\n"), HasSubstr("is no width"));
  EXPECT_THAT(refusal_of_list("frame,trigger_time_ms\n1,10\n"), HasSubstr("but 0 is next"));
  EXPECT_THAT(refusal_of_list("trigger_time_ms,width_ms\n10\n"), HasSubstr("1 cells"));
  EXPECT_THAT(refusal_of_list("trigger_time_ms\n"), HasSubstr("lists no frame"));
  EXPECT_THAT(message_of<InputError>([] { (void)read_frame_times("no-such.csv"); }),
              HasSubstr("no-such.csv"));
}

TEST(FrameBins, RefuseAScheduleLongerThanTheCycleButTakeItOverTwo) {
  // 16 phases of 188 ms are 3 s: two cycles of 1.5 s, not one of 1.2 s.
  const auto windows = windows_of(repeated_starts(12, 0.01, 0.188), {}, period_s);
  FrameBinOptions options{.windows = windows};
  EXPECT_THAT(message_of<InputError>([&] { (void)bin_frames(waves(), options); }),
              HasSubstr("longer than the cycle"));
  options.gate_every = 2;
  const FrameBins bins = bin_frames(waves(), options);
  EXPECT_DOUBLE_EQ(bins.interval_s, 2.4);
  EXPECT_EQ(bins.frames[0].cycles, 3U);
  EXPECT_NEAR(bins.frames[0].drift_kPa_per_cycle, 0.1, 1e-9);
  EXPECT_NEAR(bins.frames[0].drift_se_kPa_per_cycle, 0, 1e-9);
}

TEST(FrameBins, AMissingTriggerSpoilsTheGatedIntervalAroundIt) {
  RecordedRun run = waves();
  run.trigger_s.erase(run.trigger_s.begin() + 3);
  const FrameBins bins = bin_frames(run, {.frames = 8, .gate_every = 2});
  EXPECT_EQ(bins.frames[0].cycles, 2U);
  ASSERT_EQ(bins.excluded.size(), 1U);
  EXPECT_THAT(bins.excluded[0].reason, HasSubstr("missing"));
}

TEST(FrameBins, RemoveTheSignalsDelay) {
  const FrameBinOptions plain{.frames = 40};
  FrameBinOptions shifted = plain;
  shifted.delay_s = 0.01;
  const FrameBins truth = bin_frames(waves(), plain);
  const FrameBins late = bin_frames(waves(0.01), plain);
  const FrameBins corrected = bin_frames(waves(0.01), shifted);
  double worst_late = 0, worst_corrected = 0;
  for (size_t k = 0; k < 40; ++k) {
    worst_late = std::max(worst_late, std::abs(late.frames[k].mean_kPa - truth.frames[k].mean_kPa));
    worst_corrected =
        std::max(worst_corrected, std::abs(corrected.frames[k].mean_kPa - truth.frames[k].mean_kPa));
  }
  EXPECT_GT(worst_late, 0.05);
  EXPECT_LT(worst_corrected, 1e-9);
}

TEST(FrameBins, TakeOnlyTheImagedCyclesOfARunWithSlices) {
  RecordedRun run = waves();
  run.slices = {{"tagged", 0, 1, 2, 2, 1}, {"tagged", 1, 4, 2, 2, 1}};
  const FrameBins all = bin_frames(run, {.frames = 8});
  EXPECT_EQ(all.triggers, 4U);
  EXPECT_EQ(all.scheduled_cycles, 4);
  const FrameBins second = bin_frames(run, {.frames = 8, .slice = 1});
  EXPECT_EQ(second.frames[0].cycles, 2U);
  const FrameBins unsliced = bin_frames(waves(), {.frames = 8});
  EXPECT_NEAR(second.frames[0].mean_kPa - unsliced.frames[0].mean_kPa, 0.45 - 0.25, 1e-9);
  EXPECT_THAT(message_of<InputError>([&] { (void)bin_frames(run, {.slice = 2}); }), HasSubstr("slice 2"));
}

TEST(SignalDelay, IsThatOfCatheterAndFilterAsFarAsTheRunTells) {
  RecordedRun run = waves();
  EXPECT_EQ(signal_delay(run, "cavity_kPa").total_s(), 0);
  run.rig = {{"catheter_f0_Hz", 60.0}, {"catheter_zeta", 0.6}};
  EXPECT_NEAR(signal_delay(run, "cavity_kPa").total_s(), 0.6 / (std::numbers::pi * 60), 1e-12);
  EXPECT_EQ(signal_delay(run, "pump_kPa").total_s(), 0);
  run.pressure.notes["cavity_filtered_kPa"]["delay_s"] = 0.013;
  EXPECT_DOUBLE_EQ(signal_delay(run, "cavity_filtered_kPa").filter_s, 0.013);
}

}  // namespace
}  // namespace diastole::runfile
