// A run that stays in its file says what the same run in memory says.

#include <gmock/gmock.h>

#include <filesystem>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/soundness.hpp"
#include "tests/protocol/runfile/broken_runs.hpp"

namespace diastole::runfile {
namespace {

class EveryExample : public testing::TestWithParam<const char*> {};

TEST_P(EveryExample, InItsFileIsAsInMemory) {
  const auto path = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / GetParam();
  const RecordedRun run = read_run(path);
  const RunFile file = open_run(path);
  EXPECT_TRUE(file.run.pressure.time_s.empty());
  const Soundness in_memory = assess(run), in_file = assess(file.run, file.rows);
  EXPECT_EQ(in_file.problems, in_memory.problems);
  EXPECT_EQ(in_file.pressure.rows, in_memory.pressure.rows);
  EXPECT_EQ(in_file.pressure.rate_Hz, in_memory.pressure.rate_Hz);
  EXPECT_EQ(in_file.pump.irregularity.longest_ms, in_memory.pump.irregularity.longest_ms);
  EXPECT_EQ(in_file.saturated, in_memory.saturated);
  for (const auto& [name, range] : in_memory.ranges) {
    EXPECT_EQ(in_file.ranges.at(name).least, range.least);
    EXPECT_EQ(in_file.ranges.at(name).most, range.most);
    EXPECT_EQ(range.most, std::ranges::max(run.pressure.channels.at(name)));
  }
  for (size_t segment = 1; segment < run.segments.size(); ++segment) {
    if (run.segments[segment].waveform == "hold") continue;
    const FrameBinOptions options{.frames = 16, .segment = segment};
    const FrameBins bins = bin_frames(run, options), of_file = bin_frames(file.run, file.rows, options);
    for (size_t k = 0; k < bins.frames.size(); ++k) {
      EXPECT_EQ(of_file.frames[k].mean_kPa, bins.frames[k].mean_kPa);
      EXPECT_EQ(of_file.frames[k].sample_sd_kPa, bins.frames[k].sample_sd_kPa);
      EXPECT_EQ(of_file.frames[k].samples, bins.frames[k].samples);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OpenRun, EveryExample,
                         testing::Values("recorded-baseline.run.h5", "recorded-preload.run.h5",
                                         "recorded-no-effect.run.h5"));

TEST(OpenRun, RefusesWhatAReaderRefuses) {
  RunSketch sketch;
  sketch.cavity_kPa[2] = std::nan("");
  const auto path = scratch_file("nan.run.h5");
  write_sketch(path, sketch);
  try {
    (void)open_run(path);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/pressure/cavity_kPa, index 2"));
  }
}

/// Rows at 1 kHz, some of them left out.
std::vector<double> times_without(size_t rows, const std::vector<size_t>& absent) {
  std::vector<double> time_s;
  for (size_t i = 0; i < rows; ++i)
    if (std::ranges::find(absent, i) == absent.end()) time_s.push_back(1e-3 * static_cast<double>(i));
  return time_s;
}

TEST(Spacing, FindsHolesAtTheBlocksBorders) {
  const size_t border = Series::block_rows;
  for (const size_t absent :
       {border - 9, border - 8, border - 1, border, border + 1, border + 7, 2 * border}) {
    const std::vector<double> time_s = times_without(3 * border, {absent});
    const Spacing spacing = spacing_of(time_s);
    ASSERT_EQ(spacing.holes.size(), 1U) << absent;
    EXPECT_EQ(spacing.holes[0].row, absent);
    EXPECT_NEAR(spacing.holes[0].after_s - spacing.holes[0].before_s, 2e-3, 1e-9);
    EXPECT_EQ(spacing.irregularity.steps, 1U);
    EXPECT_NEAR(spacing.median_s, 1e-3, 1e-9);
  }
}

TEST(Spacing, OfMillionsOfRowsIsTheirMedianStep) {
  std::vector<double> time_s(3'000'000);
  for (size_t i = 0; i < time_s.size(); ++i)
    time_s[i] = 1e-4 * (static_cast<double>(i) + (i % 7 == 0 ? 0.3 : 0.0));
  const Spacing spacing = spacing_of(time_s);
  EXPECT_NEAR(spacing.median_s, 1e-4, 1e-10);
  EXPECT_TRUE(spacing.holes.empty());
}

/// Binning goes through the rows window by window; a cycle that begins in one block ends in the next.
TEST(FrameBins, OfManyBlocksCountEverySample) {
  RecordedRun run;
  run.segments = {{0, "parabolic", 1, 0.7, 0, 100}};
  for (int i = 0; i < 71'000; ++i) {
    run.pressure.time_s.push_back(1e-3 * i);
    run.pressure.channels["cavity_kPa"].push_back(i % 700 < 350 ? 1 : 3);
  }
  for (int cycle = 0; cycle < 100; ++cycle)
    run.trigger_s.push_back(0.7 * cycle);
  const FrameBins bins = bin_frames(run, {.frames = 2});
  EXPECT_TRUE(bins.excluded.empty());
  EXPECT_EQ(bins.frames[0].samples, 35'000U);
  EXPECT_NEAR(bins.frames[0].mean_kPa, 1, 1e-12);
  EXPECT_NEAR(bins.frames[1].mean_kPa, 3, 1e-12);
  EXPECT_NEAR(bins.frames[1].sample_sd_kPa, 0, 1e-7);
}

}  // namespace
}  // namespace diastole::runfile
