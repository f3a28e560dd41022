// What distinguishes runs: an effect of a given size is found, noise is not, and where noise is too large nothing is claimed.

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "tools/diastole/compare/comparison.hpp"

namespace diastole::comparison {
namespace {

using runfile::RecordedRun;
using testing::AllOf;
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
  for (int i = 0; i <= 240; ++i) {
    run.pump.time_s.push_back(i / 10.0);
    run.pump.commanded_mL.push_back(stroke_mL * 0.5 * (1 - std::cos(2 * M_PI * i / 12.0)));
  }
  return run;
}

/// Adds a pressure to the samples of one cycle.
void raise(RecordedRun& run, int cycle, double by_kPa) {
  std::vector<double>& cavity_kPa = run.pressure.channels["cavity_kPa"];
  for (size_t i = 0; i < cavity_kPa.size(); ++i)
    if (std::floor(run.pressure.time_s[i] / 1.2 + 1e-9) == cycle) cavity_kPa[i] += by_kPa;
}

/// The same run with its segment played from points, which peak at this part of the period.
RecordedRun uploaded(RecordedRun run, double peak_phase) {
  run.segments.front().waveform = "uploaded";
  run.waveforms[0] = {"", {0, peak_phase, 1}, {0, 1, 0}};
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
    alarms += compared({recorded(2 * trial), recorded(2 * trial + 1)}).outcome() == Outcome::differs ? 1 : 0;
  EXPECT_LE(alarms, 5) << "one in a hundred is promised; more than five come by chance once in 2000";
}

TEST(RunComparison, AGainAndAnOffsetAreFoundWithTheirSize) {
  const Comparison found = compared({recorded(1), recorded(2, 1.01), recorded(3, 1, 0.03)});
  const std::vector<Departure>& departures = found.overlays.front().departures;
  ASSERT_EQ(departures.size(), 2);
  EXPECT_EQ(departures[0].outcome(), Outcome::differs);
  EXPECT_NEAR(departures[0].gain, 1.01, 0.003);
  EXPECT_EQ(departures[1].outcome(), Outcome::differs);
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

TEST(RunComparison, OneWildCycleHidesNoGainAndIsNamed) {
  RecordedRun wild = recorded(2, 1.05);
  raise(wild, 7, 100);
  const Comparison found = compared({recorded(1), wild});
  const Departure& departure = found.overlays.front().departures.front();
  EXPECT_EQ(departure.outcome(), Outcome::differs);
  EXPECT_NEAR(departure.gain, 1.05, 0.003);
  EXPECT_THAT(found.remarks,
              testing::ElementsAre(AllOf(HasSubstr("run-2.run.h5: segment 0, cavity_kPa: 1 of 20 cycles"),
                                         HasSubstr("cycle 7 lies 100 kPa from"))));

  RecordedRun same = recorded(3);
  raise(same, 7, 100);
  EXPECT_EQ(compared({recorded(1), same}).outcome(), Outcome::agrees);
}

TEST(RunComparison, NoiseThatIsLargeBesideTheTraceDecidesNothing) {
  RecordedRun scattered = recorded(2, 1.05);
  for (int cycle = 0; cycle < 20; ++cycle)
    raise(scattered, cycle, cycle % 2 == 0 ? 5 : -5);
  const Comparison found = compared({recorded(1), scattered});
  EXPECT_EQ(found.outcome(), Outcome::undecided);
  EXPECT_NEAR(found.overlays.front().departures.front().allowed_Pa, 5000, 500);
  EXPECT_THAT(comparison_page(found), HasSubstr("may agree or differ"));
  EXPECT_EQ(compared({recorded(1), recorded(2)}).outcome(), Outcome::agrees);
  EXPECT_EQ(compared({recorded(1), recorded(2), scattered}).outcome(), Outcome::undecided);
}

TEST(RunComparison, AChannelThatStandsStillSaysNothingOfTheOthers) {
  std::vector<RecordedRun> runs{recorded(1), recorded(2)};
  for (RecordedRun& run : runs) {
    std::vector<double>& pump_kPa = run.pressure.channels["pump_kPa"] = run.pressure.channels["cavity_kPa"];
    for (size_t i = 0; i < pump_kPa.size(); ++i)
      pump_kPa[i] -= 2.5 * (1 - std::cos(2 * M_PI * run.pressure.time_s[i] / 1.2));
  }
  const Comparison found = compared(runs);
  EXPECT_EQ(found.count(Outcome::undecided), 1);
  EXPECT_EQ(found.outcome(), Outcome::agrees);
  EXPECT_THAT(comparison_page(found), HasSubstr("in 1 of 2 traces it is not known or large"));
}

TEST(RunComparison, OneRecordingNamedTwiceIsSaidToBeOne) {
  RecordedRun run = recorded(1), copied = recorded(1), other = recorded(2);
  run.run_id = copied.run_id = "a";
  other.run_id = "b";
  EXPECT_THAT(compared({run, other, copied}).remarks,
              testing::ElementsAre(HasSubstr("run-1.run.h5 is the recording of [0] once more")));
  EXPECT_THAT(compared({recorded(1), recorded(1)}).remarks, IsEmpty()) << "without an id nobody knows";
}

TEST(RunComparison, ReportsWhatIsNotSound) {
  RecordedRun unsound = recorded(2);
  unsound.events.push_back({3.0, "error", "daq_lost", "no answer"});
  EXPECT_THAT(compared({recorded(1), unsound}).remarks,
              testing::ElementsAre(AllOf(HasSubstr("run-2.run.h5: is not sound"), HasSubstr("daq_lost"))));
}

TEST(RunComparison, OtherPointsOfAnUploadedWaveformAreAnotherMotion) {
  const RecordedRun early = uploaded(recorded(1), 0.3), late = uploaded(recorded(2), 0.6);
  const Comparison found = compared({early, late});
  ASSERT_EQ(found.differences.size(), 1);
  EXPECT_EQ(found.differences.front().place, "segment 0 played");
  EXPECT_THAT(found.differences.front().values,
              testing::ElementsAre(HasSubstr("peak at 0.3"), HasSubstr("peak at 0.6")));
  EXPECT_FALSE(found.outcome());
  EXPECT_THAT(found.remarks, testing::ElementsAre(HasSubstr("another motion")));
  EXPECT_TRUE(compared({early, uploaded(recorded(3), 0.3)}).outcome());
}

TEST(RunComparison, WhatTheExperimentsStateOtherwiseIsNamed) {
  RecordedRun plain = recorded(1), gated = recorded(2);
  plain.protocol_toml = "rest_s = 1\n[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 40.0\n";
  gated.protocol_toml =
      "gate_every = 2\nrest_s = 3.0\n[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 40\n"
      "[[schedule.block]]\nname = \"tagged\"\n";
  std::string words;
  for (const Difference& difference : compared({plain, gated}).differences)
    words += difference.group + ": " + difference.place + " " + difference.values[0] + "|" +
             difference.values[1] + "\n";
  EXPECT_EQ(words,
            "protocol: gate_every |2\nprotocol: rest_s 1|3\nprotocol: schedule.block[0].name |tagged\n");
  gated.protocol_toml = "no toml";
  EXPECT_THAT(compared({gated, gated}).differences, IsEmpty());
  EXPECT_FALSE(compared({plain, gated}).differences.empty());
}

TEST(RunComparison, WhatARunLacksIsTold) {
  RecordedRun longer = recorded(2);
  longer.segments.push_back({24.0, "sinusoidal", 40, 1.2, 0, 20});
  longer.segments.push_back({48.0, "hold", 0, 5, 0, 1});
  longer.pressure.channels["pump_kPa"] = longer.pressure.channels["cavity_kPa"];
  const std::string pump = "pump_kPa is not in all runs: not compared";
  EXPECT_THAT(compared({recorded(1), longer}).remarks,
              testing::ElementsAre(HasSubstr("is not sound"),
                                   "run-2.run.h5: segment 1: the first run has none: not tested", pump));
  EXPECT_THAT(compared({longer, recorded(1)}).remarks,
              testing::Contains("run-1.run.h5: segment 1: this run has none: not tested"));
}

}  // namespace
}  // namespace diastole::comparison
