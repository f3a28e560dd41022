#include "protocol/runfile/soundness.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/signal/saturation.hpp"
#include "tests/protocol/runfile/broken_runs.hpp"

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

void drop_rows(std::vector<double>& values, size_t first, size_t last) {
  values.erase(values.begin() + static_cast<std::ptrdiff_t>(first),
               values.begin() + static_cast<std::ptrdiff_t>(last));
}

/// Rows [first, last) of a stream that nothing declares missing.
struct Cut {
  const char* stream;
  size_t first, last;
  const char* message;
};

class StreamCut : public testing::TestWithParam<Cut> {};

TEST_P(StreamCut, IsAFaultWithAndWithoutAGrid) {
  const Cut& cut = GetParam();
  for (const bool with_grid : {false, true}) {
    RecordedRun run = regular_run();
    if (with_grid) run.pressure.grid = run.pump.grid = {0, 3.99, 100};
    ASSERT_THAT(assess(run).problems, IsEmpty());
    if (cut.stream == pressure_stream) {
      drop_rows(run.pressure.time_s, cut.first, cut.last);
      drop_rows(run.pressure.channels["cavity_kPa"], cut.first, cut.last);
    } else {
      drop_rows(run.pump.time_s, cut.first, cut.last);
      drop_rows(run.pump.commanded_mL, cut.first, cut.last);
    }
    const Soundness soundness = assess(run);
    EXPECT_THAT(soundness.problems,
                testing::Contains(testing::AllOf(testing::StartsWith(cut.stream), HasSubstr(cut.message))));
    if (!with_grid) continue;
    EXPECT_THAT(soundness.problems, testing::Contains(HasSubstr("but 400 were due")));
  }
}

INSTANTIATE_TEST_SUITE_P(Soundness, StreamCut,
                         testing::Values(Cut{"pressure", 240, 400, "ends at 2.390 s, the run at 2.500 s"},
                                         Cut{"pressure", 0, 200, "2.000 s without a sample before index 0"},
                                         Cut{"pump", 150, 400, "ends at 1.490 s"},
                                         Cut{"pump", 0, 3, "0.030 s without"}));

/// A sound run file of another program, 3 s at 300 Hz, and the same without some rows.
TEST(Soundness, AFileThatWasCutAtEitherEndIsNotSound) {
  RunSketch whole;
  for (auto* values : {&whole.pressure_time_s, &whole.cavity_kPa, &whole.pump_time_s, &whole.commanded_mL})
    values->clear();
  for (int i = 0; i < 900; ++i) {
    whole.pressure_time_s.push_back(i / 300.0);
    whole.pump_time_s.push_back(i / 300.0);
    whole.cavity_kPa.push_back(1);
    whole.commanded_mL.push_back(0);
  }
  const auto problems = [](const RunSketch& sketch) {
    const auto file = scratch_file("cut.run.h5");
    write_sketch(file, sketch);
    return assess(read_run(file)).problems;
  };
  EXPECT_THAT(problems(whole), IsEmpty());
  RunSketch last = whole, first = whole, pump = whole;
  for (auto* values : {&last.pressure_time_s, &last.cavity_kPa})
    drop_rows(*values, 555, 900);
  for (auto* values : {&first.pressure_time_s, &first.cavity_kPa})
    drop_rows(*values, 0, 460);
  for (auto* values : {&pump.pump_time_s, &pump.commanded_mL})
    drop_rows(*values, 345, 900);
  EXPECT_THAT(problems(last),
              testing::ElementsAre(HasSubstr("pressure: ends at 1.847 s, the run at 2.500 s")));
  EXPECT_THAT(problems(first),
              testing::ElementsAre(HasSubstr("pressure: 1.533 s without a sample before index 0")));
  EXPECT_THAT(problems(pump), testing::ElementsAre(HasSubstr("pump: ends at 1.147 s")));
}

TEST(Soundness, OneRowFewerThanWereDueIsAFaultAtEitherEnd) {
  for (const size_t row : {size_t{0}, size_t{399}}) {
    RecordedRun run = regular_run();
    run.pressure.grid = {0, 3.99, 100};
    drop_rows(run.pressure.time_s, row, row + 1);
    drop_rows(run.pressure.channels["cavity_kPa"], row, row + 1);
    EXPECT_THAT(assess(run).problems,
                testing::ElementsAre("pressure: 399 rows, but 400 were due by the clocks"));
  }
}

TEST(Soundness, AStreamMayEndWhereTheRunWasBrokenOff) {
  RecordedRun run = regular_run();
  for (auto* values :
       {&run.pressure.time_s, &run.pressure.channels["cavity_kPa"], &run.pump.time_s, &run.pump.commanded_mL})
    values->resize(150);
  run.events = {{1.5, "info", "stopped_now", "stopped on request"}};
  EXPECT_THAT(assess(run).problems, IsEmpty());
  run.events.clear();
  EXPECT_EQ(assess(run).problems.size(), 2U);
}

TEST(Soundness, ARunWithoutAPositionOfThePumpIsNotSound) {
  RecordedRun run = regular_run();
  run.pump = {};
  EXPECT_THAT(assess(run).problems, testing::ElementsAre(HasSubstr("no position of the pump")));
}

TEST(Soundness, ARunOfDeclaredGapsAloneSaysThatNoPressureWasRecorded) {
  RecordedRun run = regular_run();
  for (double& value_kPa : run.pressure.channels["cavity_kPa"])
    value_kPa = std::nan("");
  run.gaps = {{"pressure", 0, 400, "no answer"}};
  EXPECT_THAT(assess(run).problems, testing::Contains(HasSubstr("no pressure was recorded")));
}

/// Rest, then a sine of `amplitude_kPa` at 2 Hz, in codes of 1/100 kPa, as an instrument that ends at ± 100 kPa shows it.
std::vector<double> measured(double amplitude_kPa, double noise_kPa = 0.02) {
  std::mt19937 random(17);
  std::normal_distribution<double> noise(0, noise_kPa);
  std::vector<double> values_kPa;
  for (int i = 0; i < 400; ++i) {
    const double value_kPa =
        amplitude_kPa * std::sin(2 * 3.14159265 * 0.02 * std::max(i - 100, 0)) + noise(random);
    values_kPa.push_back(std::clamp(std::round(100 * value_kPa) / 100, -100.0, 100.0));
  }
  return values_kPa;
}

TEST(Saturation, IsCountedByChannelAndMakesARunUnsound) {
  RecordedRun run = regular_run();
  run.pressure.channels["cavity_kPa"] = measured(60);
  run.pressure.channels["pump_kPa"] = measured(127);
  run.pressure.channels["pump_filtered_kPa"] = measured(127);
  const Soundness soundness = assess(run);
  EXPECT_EQ(soundness.saturated.at("cavity_kPa"), 0);
  const auto& pump_kPa = run.pressure.channels["pump_kPa"];
  const auto at_the_end =
      std::ranges::count_if(pump_kPa, [](double value) { return std::abs(value) == 100; });
  EXPECT_GT(at_the_end, 100);
  EXPECT_EQ(soundness.saturated.at("pump_kPa"), at_the_end);
  EXPECT_FALSE(soundness.saturated.contains("pump_filtered_kPa"));
  EXPECT_THAT(soundness.problems,
              testing::ElementsAre(HasSubstr("pressure/pump_kPa: "), HasSubstr("100.000 kPa")));
}

/// What the recording, or a gap, cuts off has one side to be known by.
TEST(Saturation, IsCountedWhereTheRecordingBeginsOrEndsInIt) {
  constexpr std::ptrdiff_t cut_off = 150;
  for (const bool at_the_begin : {true, false}) {
    RecordedRun run = regular_run();
    std::vector<double> values = measured(60);
    std::fill_n(at_the_begin ? values.begin() : values.end() - cut_off, cut_off, 100.0);
    run.pressure.channels["cavity_kPa"] = values;
    EXPECT_EQ(assess(run).saturated.at("cavity_kPa"), cut_off) << at_the_begin;
  }
  RecordedRun run = regular_run();
  std::vector<double> wave;  // which begins at its peak, leaves it in a curve and comes to rest
  std::mt19937 random(6);
  for (int i = 0; i < 400; ++i)
    wave.push_back(std::clamp(std::round(12'700 * std::cos(std::min(0.05 * i, std::numbers::pi / 2)) +
                                         static_cast<double>(random() % 3)) /
                                  100,
                              -100.0, 100.0));
  run.pressure.channels["cavity_kPa"] = wave;
  EXPECT_EQ(assess(run).saturated.at("cavity_kPa"),
            std::ranges::count_if(wave, [](double value) { return std::abs(value) == 100; }));
  std::vector<double> values = measured(127);
  const auto whole = std::ranges::count_if(values, [](double value) { return std::abs(value) == 100; });
  const auto beyond = std::ranges::find(values, 100.0);
  ASSERT_EQ(beyond[signal::SaturationWatch::kLeastRun], 100.0);
  *beyond = std::nan("");
  run.gaps = {{"pressure", beyond - values.begin(), 1, "no answer"}};
  run.pressure.channels["cavity_kPa"] = values;
  EXPECT_EQ(assess(run).saturated.at("cavity_kPa"), whole - 1);
}

TEST(Saturation, AChannelThatShowsOneValueIsNotSound) {
  RecordedRun run = regular_run();
  auto& cavity_kPa = run.pressure.channels["cavity_kPa"];
  EXPECT_THAT(assess(run).problems, testing::Not(testing::Contains(HasSubstr("throughout"))));
  while (cavity_kPa.size() < signal::SaturationWatch::kLeastStill) {
    cavity_kPa.push_back(1);
    run.pressure.time_s.push_back(0.01 * static_cast<double>(run.pressure.time_s.size()));
  }
  EXPECT_THAT(assess(run).problems, testing::Contains(HasSubstr("stands at 1.000 kPa throughout")));
}

/// Just beyond the end a wave rises by half a kilopascal a sample, of which the end leaves whatever part: by the last step alone,
/// two peaks in three would be missed.
TEST(Saturation, IsSeenWhereverTheEndCutsTheLastStep) {
  constexpr int starts = 50;
  constexpr double samples = 400.0;
  for (int start = 0; start < starts; ++start) {
    signal::SaturationWatch watch;
    std::mt19937 random(static_cast<unsigned>(start));
    for (const double at_rest_kPa : {0.0, 0.01, 0.0})
      watch.push(at_rest_kPa);
    int64_t at_the_end = 0;
    for (int i = 0; i < 2 * static_cast<int>(samples); ++i) {
      const double turn = (i + static_cast<double>(start) / starts) / samples;
      const double value_kPa = (std::round(10500.0 * std::sin(2.0 * std::numbers::pi * turn)) +
                                static_cast<double>(random() % 3)) /
                               100.0;
      watch.push(std::clamp(value_kPa, -100.0, 100.0));
      if (std::abs(value_kPa) >= 100.0) ++at_the_end;
    }
    EXPECT_EQ(watch.samples(), at_the_end) << start;
  }
}

TEST(Saturation, IsNotASignalThatRestsAtItsExtreme) {
  RecordedRun run = regular_run();
  auto& cavity_kPa = run.pressure.channels["cavity_kPa"];
  cavity_kPa = measured(60);
  std::fill_n(cavity_kPa.begin(), 100, cavity_kPa[100]);  // before the motion
  std::mt19937 random(3);
  for (int i = 300; i < 400; ++i)
    cavity_kPa[static_cast<size_t>(i)] =
        -61.0 + 0.01 * static_cast<double>(random() % 2);  // flickers at the bottom
  EXPECT_EQ(assess(run).saturated.at("cavity_kPa"), 0);
  for (double& value_kPa : cavity_kPa)
    value_kPa = 3;
  EXPECT_EQ(assess(run).saturated.at("cavity_kPa"), 0);
}

TEST(Saturation, IsNotAnInstrumentOfCoarseCodes) {
  for (const double amplitude_kPa : {0.03, 0.3, 3.0, 30.0}) {
    RecordedRun run = regular_run();
    run.pressure.channels["cavity_kPa"] = measured(amplitude_kPa, 0.01);
    EXPECT_EQ(assess(run).saturated.at("cavity_kPa"), 0) << amplitude_kPa;
  }
}

}  // namespace
}  // namespace diastole::runfile
