#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "tools/diastole/replay/compare.hpp"
#include "tools/diastole/replay/replay_report.hpp"

namespace diastole::replay {
namespace {

using runfile::RecordedRun;
using testing::HasSubstr;

constexpr double microstep_mL = 0.01;

/// Three cycles of a second, 40 microsteps out and back; 100 samples and positions a second.
RecordedRun run_of_three_cycles() {
  RecordedRun run;
  run.rig = {{"volume_per_step_mL", microstep_mL}, {"cavity_kPa_per_V", 4.0}};
  run.trigger_s = {0.5, 1.5, 2.5};
  for (int i = 0; i < 360; ++i) {
    const int in_cycle = i < 50 ? 0 : (i - 50) % 100;
    run.pump.time_s.push_back(0.01 * i);
    run.pump.commanded_mL.push_back(microstep_mL * (in_cycle < 40 ? in_cycle : std::max(0, 80 - in_cycle)));
    run.pressure.time_s.push_back(0.002 + 0.01 * i);
    run.pressure.channels["cavity_kPa"].push_back(0.25 * (i % 9));
  }
  return run;
}

Comparison compare(const RecordedRun& recorded, const RecordedRun& replayed) {
  return replay::compare({recorded, runfile::rows_of(recorded)}, {replayed, runfile::rows_of(replayed)});
}

TEST(ReplayCompare, ARunEqualsItselfWhateverTheStartPhase) {
  const RecordedRun run = run_of_three_cycles();
  RecordedRun later = run;
  for (double& time_s : later.pressure.time_s)
    time_s += 0.001;
  for (const RecordedRun& replayed : {run, later}) {
    const Comparison found = compare(run, replayed);
    EXPECT_TRUE(found.equal()) << found.first->text;
    EXPECT_EQ(found.max_abs_diff_kPa, 0);
  }
  EXPECT_NEAR(compare(run, later).start_phase_s, 0.001, 1e-12);
  later.pressure.time_s.pop_back();
  later.pressure.channels["cavity_kPa"].pop_back();
  EXPECT_TRUE(compare(run, later).equal()) << "with another phase one sample less lies before the end";
}

TEST(ReplayCompare, SamplesMoreThanOneSpacingOffAreToldInTheLastLine) {
  const RecordedRun replayed = run_of_three_cycles();
  const auto last_line = [&](double late_s) {
    RecordedRun run = replayed;
    run.pressure.time_s[200] += late_s;
    ReplayReport report;
    report.comparison = compare(run, replayed);
    EXPECT_EQ(report.comparison.samples_in_time(), late_s < 0.01);
    EXPECT_NEAR(report.comparison.max_sample_time_diff_s, late_s, 1e-9);
    return as_table(report);
  };
  EXPECT_THAT(last_line(0.009), testing::EndsWith("The replay is the recording.\n"));
  EXPECT_THAT(last_line(0.0135),
              testing::AllOf(HasSubstr("but for the times of samples"), HasSubstr("13.500 ms off")));
}

TEST(ReplayCompare, TellsTheFirstDifferenceWithTimeAndCycle) {
  const RecordedRun run = run_of_three_cycles();
  RecordedRun other = run;
  other.pressure.channels["cavity_kPa"][300] += 0.001;
  other.pressure.channels["cavity_kPa"][200] -= 0.002;
  other.trigger_s[2] += 1e-6;
  const Comparison found = compare(run, other);
  EXPECT_FALSE(found.equal());
  EXPECT_FALSE(found.pressure_equal);
  EXPECT_FALSE(found.triggers_equal);
  EXPECT_TRUE(found.steps_equal);
  ASSERT_TRUE(found.first);
  EXPECT_NEAR(found.first->time_s, 2.002, 1e-9);
  EXPECT_EQ(found.first->cycle, 1);
  EXPECT_THAT(found.first->text, HasSubstr("sample 200"));
  EXPECT_NEAR(found.max_abs_diff_kPa, 0.002, 1e-9);
  EXPECT_LT(found.tolerance_kPa, 1e-6);
}

TEST(ReplayCompare, AMicrostepMoreIsADifference) {
  const RecordedRun run = run_of_three_cycles();
  RecordedRun other = run;
  other.pump.commanded_mL[170] += microstep_mL;
  const Comparison found = compare(run, other);
  EXPECT_FALSE(found.steps_equal);
  EXPECT_EQ(found.max_steps_diff, 1);
  EXPECT_EQ(found.first->cycle, 1);
  EXPECT_TRUE(found.triggers_equal && found.pressure_equal && found.events_equal);
}

TEST(ReplayCompare, TheSameSamplesMustBeMissing) {
  RecordedRun run = run_of_three_cycles();
  run.pressure.channels["cavity_kPa"][100] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(compare(run, run).equal());
  RecordedRun other = run;
  std::swap(other.pressure.channels["cavity_kPa"][100], other.pressure.channels["cavity_kPa"][101]);
  const Comparison found = compare(run, other);
  EXPECT_FALSE(found.missing_equal);
  EXPECT_THAT(found.first->text, HasSubstr("sample 100"));
}

TEST(ReplayCompare, MissingTriggersAndSamplesAreDifferences) {
  const RecordedRun run = run_of_three_cycles();
  RecordedRun other = run;
  other.trigger_s.pop_back();
  EXPECT_FALSE(compare(run, other).triggers_equal);
  EXPECT_THAT(compare(run, other).first->text, HasSubstr("trigger 2 is missing"));
  EXPECT_THAT(compare(other, run).first->text, HasSubstr("trigger 2 is not in the recording"));
  other = run;
  other.pressure.time_s.pop_back();
  other.pressure.channels["cavity_kPa"].pop_back();
  EXPECT_FALSE(compare(run, other).samples_equal);
}

TEST(ReplayCompare, FaultsAndTheEndMustBeTheSame) {
  RecordedRun run = run_of_three_cycles();
  run.events = {{1.7, "error", "estop", ""}};
  RecordedRun other = run;
  other.events[0].time_s += 249e-6;
  EXPECT_TRUE(compare(run, other).equal());
  other.events[0].time_s += 10e-6;
  EXPECT_FALSE(compare(run, other).events_equal);
  other = run;
  other.events[0].code = "limit_switch";
  EXPECT_FALSE(compare(run, other).events_equal);
  other.events.clear();
  const Comparison found = compare(run, other);
  EXPECT_THAT(found.first->text, HasSubstr("estop"));
  EXPECT_EQ(found.first->cycle, 1);
  EXPECT_THAT(found.lines.back().recorded, "faulted: estop");
}

TEST(ReplayCompare, ALostLeaseMayComeAHeartbeatOff) {
  RecordedRun run = run_of_three_cycles();
  run.events.push_back({2.0, "error", "lease_lost", ""});
  const auto off_by = [&](double shift_s) {
    RecordedRun other = run;
    other.events[0].time_s += shift_s;
    return compare(run, other).events_equal;
  };
  EXPECT_TRUE(off_by(0.05));
  EXPECT_TRUE(off_by(-0.05));
  EXPECT_FALSE(off_by(0.051));
}

TEST(ReplayCompare, OfABrokenOffRecordingOnlyWhatThereIsCounts) {
  const RecordedRun whole = run_of_three_cycles();
  RecordedRun broken = whole;
  broken.trigger_s.pop_back();
  for (auto* series : {&broken.pump.time_s, &broken.pump.commanded_mL, &broken.pressure.time_s,
                       &broken.pressure.channels["cavity_kPa"]})
    series->resize(200);
  EXPECT_FALSE(compare(broken, whole).equal());
  broken.events = {{2.0, "error", "incomplete", ""}};
  EXPECT_TRUE(compare(broken, whole).equal());
}

/// A run of 60,000 rows that lie elsewhere; `largest_block` is the most rows that were asked for at once.
runfile::RunFile run_elsewhere(size_t& largest_block, std::function<double(size_t)> pressure_kPa) {
  constexpr size_t rows = 60'000;
  const auto series = [&largest_block](auto value) {
    return runfile::Series(rows, [&largest_block, value](size_t first, std::span<double> values) {
      largest_block = std::max(largest_block, values.size());
      for (size_t i = 0; i < values.size(); ++i)
        values[i] = value(first + i);
    });
  };
  runfile::RunFile file;
  file.run.rig = {{"volume_per_step_mL", microstep_mL}, {"cavity_kPa_per_V", 4.0}};
  file.run.trigger_s = {1.0, 3.0};
  file.rows.pump.time_s = file.rows.pressure.time_s =
      series([](size_t row) { return 1e-4 * static_cast<double>(row); });
  file.rows.pump.values["commanded_mL"] =
      series([](size_t row) { return microstep_mL * static_cast<double>(row % 20'000 / 100); });
  file.rows.pressure.values["cavity_kPa"] = series(std::move(pressure_kPa));
  return file;
}

TEST(ReplayCompare, RowsAreReadBlockByBlockAndToTheirEnd) {
  size_t largest_block = 0;
  const auto usual = [](size_t row) { return 0.25 * static_cast<double>(row % 9); };
  const runfile::RunFile run = run_elsewhere(largest_block, usual);
  const Comparison same = replay::compare(run, run);
  EXPECT_TRUE(same.equal());
  EXPECT_LE(largest_block, runfile::Series::block_rows);
  const Comparison off = replay::compare(run, run_elsewhere(largest_block, [&](size_t row) {
                                           if (row == 50'000) return std::nan("");
                                           return usual(row) + (row == 40'000 || row == 59'999 ? 0.5 : 0.0);
                                         }));
  EXPECT_FALSE(off.pressure_equal || off.missing_equal);
  EXPECT_THAT(off.first->text, HasSubstr("cavity_kPa of sample 40000"));
  EXPECT_EQ(off.first->cycle, 1);
  EXPECT_EQ(off.max_abs_diff_kPa, 0.5);
  const auto inflating = std::ranges::find(off.lines, "microsteps inflating, all cycles", &Line::what);
  ASSERT_NE(inflating, off.lines.end());
  EXPECT_EQ(inflating->recorded, std::to_string((199 - 99) + 199 + 199))
      << "from the row of the first trigger on";
}

}  // namespace
}  // namespace diastole::replay
