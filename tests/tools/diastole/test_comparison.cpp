// What tells runs apart: an effect of a given size is found, noise is not.

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tools/diastole/compare/comparison.hpp"

namespace diastole::comparison {
namespace {

using runfile::RecordedRun;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double noise_kPa = 0.03;

/// Twenty cycles of a pressure of 5 kPa, with noise.
RecordedRun recorded(unsigned seed, double gain = 1, double offset_kPa = 0, double stroke_mL = 40) {
  RecordedRun run;
  run.file = "run-" + std::to_string(seed) + ".run.h5";
  run.segments = {{0, "parabolic", stroke_mL, 1.2, 0, 20}};
  run.rig["hose_length_m"] = 5.0;
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise(0, noise_kPa);
  std::vector<double>& cavity_kPa = run.pressure.channels["cavity_kPa"];
  for (int i = 0; i < 300 * 24 + 30; ++i) {
    const double time_s = i / 300.0;
    run.pressure.time_s.push_back(time_s);
    cavity_kPa.push_back(offset_kPa + gain * 2.5 * (1 - std::cos(2 * M_PI * time_s / 1.2)) + noise(engine));
  }
  for (int cycle = 0; cycle < 20; ++cycle)
    run.trigger_s.push_back(1.2 * cycle);
  return run;
}

Comparison compared(const std::vector<RecordedRun>& runs, std::vector<runfile::Session> sessions = {}) {
  std::vector<runfile::RunFile> opened;
  for (const RecordedRun& run : runs)
    opened.push_back({run, runfile::rows_of(run)});
  sessions.resize(runs.size());
  return compare(opened, sessions, 40);
}

TEST(RunComparison, EqualRunsWithOtherNoiseAgreeAsOftenAsIsPromised) {
  int alarms = 0;
  for (unsigned trial = 0; trial < 100; ++trial)
    alarms += compared({recorded(2 * trial), recorded(2 * trial + 1)}).beyond_noise() ? 1 : 0;
  EXPECT_LE(alarms, 5) << "one in a hundred is promised; more than five come by chance once in 2000";
}

TEST(RunComparison, AGainAndAnOffsetAreFoundWithTheirSize) {
  const Comparison found = compared({recorded(1), recorded(2, 1.01), recorded(3, 1, 0.03)});
  const std::vector<Departure>& departures = found.overlays.front().departures;
  ASSERT_EQ(departures.size(), 2);
  EXPECT_TRUE(departures[0].beyond_noise());
  EXPECT_NEAR(departures[0].gain, 1.01, 0.003);
  EXPECT_TRUE(departures[1].beyond_noise());
  EXPECT_NEAR(departures[1].offset_Pa, 30, 2);
  EXPECT_NEAR(departures[1].gain, 1, 0.003);
}

TEST(RunComparison, WhatWasSetOtherwiseIsNamedAndAnotherMotionIsNotTested) {
  RecordedRun other = recorded(2, 1, 0, 30);
  other.rig["hose_length_m"] = 6.0;
  other.rig["cavity_kPa_per_V"] = 4.1;
  runfile::Session session;
  session.facts["specimen"] = std::string("gel-7");
  const Comparison found = compared({recorded(1), other}, {{}, session});
  std::string words;
  for (const Difference& difference : found.differences)
    words += difference.group + ": " + difference.place + " " + difference.values[0] + "|" +
             difference.values[1] + "\n";
  EXPECT_EQ(words,
            "session: specimen |gel-7\nprotocol: segment 0 stroke_mL 40|30\ncalibration: cavity_kPa_per_V "
            "|4.1\nrig: hose_length_m "
            "5|6\n");
  EXPECT_THAT(found.overlays.front().departures, IsEmpty());
  ASSERT_EQ(found.remarks.size(), 1);
  EXPECT_THAT(found.remarks.front(), HasSubstr("another motion"));
  EXPECT_THAT(comparison_page(found), HasSubstr("gel-7"));
  EXPECT_THAT(comparison_page(found), HasSubstr("not tested"));
}

TEST(RunComparison, WhatARunLacksIsTold) {
  RecordedRun longer = recorded(2);
  longer.segments.push_back({24.0, "sinusoidal", 40, 1.2, 0, 20});
  longer.segments.push_back({48.0, "hold", 0, 5, 0, 1});
  longer.pressure.channels["pump_kPa"] = longer.pressure.channels["cavity_kPa"];
  const std::string pump = "pump_kPa is not in all runs: not compared";
  EXPECT_THAT(compared({recorded(1), longer}).remarks,
              testing::ElementsAre("run-2.run.h5: segment 1: the first run has none: not tested", pump));
  EXPECT_THAT(compared({longer, recorded(1)}).remarks,
              testing::Contains("run-1.run.h5: segment 1: this run has none: not tested"));
}

}  // namespace
}  // namespace diastole::comparison
