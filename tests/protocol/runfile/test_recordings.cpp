// Recordings that an independent program made must open and bin without complaint: three small ones in
// examples/, sessions in tests/data, and the whole set beside the source tree where it is there.

#include <gmock/gmock.h>

#include <filesystem>

#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"

namespace diastole::runfile {
namespace {

const std::filesystem::path source_dir = DIASTOLE_SOURCE_DIR;

TEST(Recordings, TheExampleBaselineIsReadAsItWasWritten) {
  const RecordedRun run = read_run(source_dir / "examples/recorded-baseline.run.h5");
  ASSERT_EQ(run.segments.size(), 3U);
  EXPECT_EQ(run.segments[1].waveform, "parabolic");
  EXPECT_DOUBLE_EQ(run.segments[1].stroke_mL, 40);
  EXPECT_EQ(run.segments[1].cycles, 30);
  EXPECT_EQ(run.trigger_s.size(), 30U);
  EXPECT_EQ(run.pressure.time_s.size(), 12000U);
  EXPECT_DOUBLE_EQ(std::get<double>(run.rig.at("bore_mm")), 100);
  EXPECT_TRUE(run.gaps.empty());

  const FrameBins bins = bin_frames(run, {.frames = 16});
  EXPECT_EQ(bins.segment, 1U);
  EXPECT_TRUE(bins.excluded.empty());
  double peak_kPa = 0;
  for (const FrameBin& bin : bins.frames) {
    EXPECT_EQ(bin.cycles, 30U);
    EXPECT_LT(bin.sd_kPa, 0.2);
    peak_kPa = std::max(peak_kPa, bin.mean_kPa);
  }
  EXPECT_GT(peak_kPa, 1.5);
  EXPECT_LT(peak_kPa, 10);
}

TEST(Recordings, TheExamplePreloadHasASegmentWithAnOffset) {
  const RecordedRun run = read_run(source_dir / "examples/recorded-preload.run.h5");
  ASSERT_EQ(run.segments.size(), 4U);
  EXPECT_DOUBLE_EQ(run.segments[2].offset_mL, 20);
  const FrameBins bins = bin_frames(run, {.frames = 16, .segment = 2});
  EXPECT_EQ(bins.frames[0].cycles, 10U);
}

TEST(Recordings, TheExampleWithoutAnEffectBinsWhole) {
  const RecordedRun run = read_run(source_dir / "examples/recorded-no-effect.run.h5");
  const FrameBins bins = bin_frames(run, {.frames = 16});
  EXPECT_EQ(bins.frames[0].cycles, 30U);
  EXPECT_TRUE(bins.excluded.empty());
  EXPECT_TRUE(assess(run).sound());
}

TEST(Recordings, EverySessionOpensAndBins) {
  const auto whole = source_dir.parent_path() / "shared/data/rig";
  size_t runs = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(
           std::filesystem::exists(whole) ? whole : source_dir / "tests/data/rig")) {
    if (!entry.path().string().ends_with(".run.h5")) continue;
    SCOPED_TRACE(entry.path());
    const RecordedRun run = read_run(entry.path());
    const FrameBins bins = bin_frames(run, {.frames = 16});
    EXPECT_EQ(static_cast<int64_t>(bins.triggers), bins.scheduled_cycles);
    EXPECT_TRUE(bins.excluded.empty());
    EXPECT_TRUE(assess(run).sound());
    ++runs;
  }
  EXPECT_GT(runs, 15U);
}

}  // namespace
}  // namespace diastole::runfile
