#include "protocol/runfile/soundness.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace diastole::runfile {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// 400 rows at 100 Hz and one triggered cycle.
RecordedRun regular_run() {
  RecordedRun run;
  run.segments = {{0.5, "parabolic", 10, 2, 0, 1}};
  run.trigger_s = {0.5};
  for (int i = 0; i < 400; ++i) {
    run.pressure.time_s.push_back(0.01 * i);
    run.pressure.channels["cavity_kPa"].push_back(1);
    run.pump.time_s.push_back(0.01 * i);
    run.pump.commanded_mL.push_back(0);
  }
  return run;
}

void drop_row(RecordedRun& run, std::ptrdiff_t row) {
  run.pressure.time_s.erase(run.pressure.time_s.begin() + row);
  auto& cavity_kPa = run.pressure.channels["cavity_kPa"];
  cavity_kPa.erase(cavity_kPa.begin() + row);
}

TEST(Soundness, EveryLatenessUnderOnePeriodIsIrregularButSound) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> late_s(0, 0.0099);
  RecordedRun run = regular_run();
  for (double& time_s : run.pressure.time_s)
    time_s += random() % 4 == 0 ? late_s(random) : 0;
  const Soundness soundness = assess(run);
  EXPECT_THAT(soundness.problems, IsEmpty());
  EXPECT_GT(soundness.pressure.irregularity.steps, 5U);
  EXPECT_GT(soundness.pressure.irregularity.longest_ms, 16);
  EXPECT_EQ(soundness.pump.irregularity.steps, 0U);
}

TEST(Soundness, ALateLastRowIsNoHole) {
  RecordedRun run = regular_run();
  run.pressure.time_s.back() += 0.0099;
  EXPECT_THAT(assess(run).problems, IsEmpty());
}

class AbsentRow : public testing::TestWithParam<int> {};

TEST_P(AbsentRow, ThatNoGapDeclaresIsAFaultAlsoAmongLateOnes) {
  for (const double late_s : {0.0, 0.004, 0.008}) {
    RecordedRun run = regular_run();
    drop_row(run, GetParam());
    run.pressure.time_s[static_cast<size_t>(GetParam()) - 1] += late_s;
    const Soundness soundness = assess(run);
    ASSERT_EQ(soundness.problems.size(), 1U) << late_s;
    EXPECT_THAT(soundness.problems[0], HasSubstr("before index " + std::to_string(GetParam())));
    EXPECT_THAT(soundness.problems[0], testing::Not(HasSubstr("more")));
  }
}

INSTANTIATE_TEST_SUITE_P(Soundness, AbsentRow, testing::Values(2, 3, 100, 250, 396));

TEST(Soundness, TwoHolesCloseToEachOtherAreTwo) {
  RecordedRun run = regular_run();
  drop_row(run, 205);
  drop_row(run, 200);
  const Soundness soundness = assess(run);
  ASSERT_EQ(soundness.problems.size(), 1U);
  EXPECT_THAT(soundness.problems[0], HasSubstr("before index 200"));
  EXPECT_THAT(soundness.problems[0], HasSubstr("and 1 more"));
}

TEST(Soundness, ARunOfDeclaredGapsAloneSaysThatNoPressureWasRecorded) {
  RecordedRun run = regular_run();
  for (double& value_kPa : run.pressure.channels["cavity_kPa"])
    value_kPa = std::nan("");
  run.gaps = {{"pressure", 0, 400, "no answer"}};
  EXPECT_THAT(assess(run).problems, testing::Contains(HasSubstr("no pressure was recorded")));
}

}  // namespace
}  // namespace diastole::runfile
