// Points files: what is taken, what is refused with its line, and how points come onto even phases.

#include "host/config/points_file.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/config/even_waveform.hpp"
#include "host/config/experiment.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(PointsFile, PhaseAndFraction) {
  const PointsFile points =
      parse_points("# a comment\nphase,fraction\n0,0\n0.25, 0.5 # half\n\n0.5,1\n1,0\n", "x");
  EXPECT_EQ(points.phase, (std::vector<double>{0, 0.25, 0.5, 1}));
  EXPECT_EQ(points.fraction, (std::vector<double>{0, 0.5, 1, 0}));
  EXPECT_FALSE(points.cycle_s || points.range_mL);
}

TEST(PointsFile, TimesAndVolumesTellPeriodAndStroke) {
  const PointsFile points = parse_points("time_s,volume_mL\r\n0,50\r\n0.4,90\r\n0.8,50.001\r\n", "x");
  EXPECT_EQ(points.phase, (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(points.fraction, (std::vector<double>{0, 1, 0}));
  EXPECT_DOUBLE_EQ(points.cycle_s.value_or(0), 0.8);
  EXPECT_DOUBLE_EQ(points.range_mL.value_or(0), 40);
}

TEST(PointsFile, ASpreadsheetsByteOrderMarkIsNoPartOfTheFirstName) {
  const PointsFile points = parse_points("\xef\xbb\xbfphase,fraction\r\n0,0\r\n0.5,1\r\n1,0\r\n", "x");
  EXPECT_EQ(points.phase, (std::vector<double>{0, 0.5, 1}));
}

TEST(PointsFile, MistakesAreNamedWithTheirLine) {
  const auto refusal = [](const std::string& text) {
    return message_of<InputError>([&] { parse_points(text, "heart.csv"); });
  };
  const std::string head = "phase,fraction\n";
  EXPECT_THAT(refusal(""), HasSubstr("phase,fraction"));
  EXPECT_THAT(refusal("phase;fraction\n0;0\n"), AllOf(HasSubstr("line 1"), HasSubstr("two columns")));
  EXPECT_THAT(refusal("t,volume\n"), AllOf(HasSubstr("\"t\""), HasSubstr("time_s")));
  EXPECT_THAT(refusal(head + "0,0\n1,0\n"), AllOf(HasSubstr("heart.csv"), HasSubstr("2 points")));
  EXPECT_THAT(refusal(head + "0,0\nnan,1\n1,0\n"), AllOf(HasSubstr("line 3"), HasSubstr("\"nan\"")));
  EXPECT_THAT(refusal(head + "0,0\n0.5,1\n0.5,1\n1,0\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("not greater")));
  EXPECT_THAT(refusal(head + "0.1,0\n0.5,1\n1,0\n"), AllOf(HasSubstr("line 2"), HasSubstr("begins at 0.1")));
  EXPECT_THAT(refusal(head + "0,0\n0.5,1\n0.9,0\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("closes the cycle")));
  EXPECT_THAT(refusal(head + "0,0\n0.5,1\n1,0.01\n"), AllOf(HasSubstr("line 4"), HasSubstr("0.01")));
  EXPECT_THAT(refusal(head + "0,0.5\n0.5,1\n0.8,0\n1,0.5\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("least volume"), HasSubstr("lowest point")));
  EXPECT_THAT(refusal(head + "0,0\n0.5,0.8\n1,0\n"), HasSubstr("greatest 1"));
  EXPECT_THAT(refusal(head + "0,0\n0.5,0\n1,0\n"), HasSubstr("hold"));
}

/// A file of other columns "has 912187 bytes: give fewer points".
TEST(PointsFile, WhatIsNoPointsFileIsRefusedByItsFirstLineHoweverLarge) {
  const auto refusal = [](const std::string& head) {
    std::string text = head + "\n";
    while (text.size() < 1'000'000)
      text += "0,0.5\n";
    return message_of<InputError>([&] { parse_points(text, "gel.tags.csv"); });
  };
  EXPECT_THAT(refusal("frame,nx,ny"),
              AllOf(HasSubstr("line 1: \"frame,nx,ny\" is not two columns"), HasSubstr("phase or time_s")));
  EXPECT_THAT(refusal("x_mm,y_mm"), HasSubstr("line 1: names the columns \"x_mm\" and \"y_mm\""));
  EXPECT_THAT(refusal("# made elsewhere\nphase,fraction"),
              AllOf(HasSubstr("line 2: begins points of 1000"), HasSubstr("fewer points")));
  EXPECT_THAT(refusal(std::string(500'000, 'x')), HasSubstr("a text of 500000 bytes is not two columns"));
}

TEST(EvenWaveform, EvenPointsAreTheControllersOwn) {
  PointsFile points;
  for (int i = 0; i <= 40; ++i) {
    points.phase.push_back(i / 40.0);
    points.fraction.push_back((1 - std::cos(2 * M_PI * i / 40)) / 2);
  }
  ASSERT_EQ(even_points(points), 40U);
  const EvenWaveform even = on_even_phases(points, 4096);
  EXPECT_EQ(even.off_grid, 0);
  ASSERT_EQ(even.rises.size(), 40U);
  EXPECT_EQ(std::accumulate(even.rises.begin(), even.rises.end(), 0), 0);
  const std::vector<double> played = even.fractions();
  for (size_t i = 0; i <= 40; ++i)
    EXPECT_NEAR(played[i], points.fraction[i], 1 / 65534.0 * 0.1);
}

TEST(EvenWaveform, UnevenPointsLieOnTheGridIfTheyCan) {
  const PointsFile points =
      parse_points("phase,fraction\n0,0\n0.13,0.4\n0.35,0.9\n0.42,1\n0.8,0.1\n1,0\n", "x");
  EXPECT_EQ(even_points(points), 0U);
  const EvenWaveform even = on_even_phases(points, 4096);
  EXPECT_EQ(even.off_grid, 0);
  EXPECT_EQ(even.rises.size() % 100, 0U);
  const std::vector<double> played = even.fractions();
  const auto grid = static_cast<double>(even.rises.size());
  for (size_t i = 0; i < points.phase.size(); ++i)
    EXPECT_NEAR(played[static_cast<size_t>(std::lround(points.phase[i] * grid))], points.fraction[i], 1e-6);
  // One rise and one fall, as the points have.
  const auto top = std::ranges::max_element(played);
  EXPECT_TRUE(std::is_sorted(played.begin(), top + 1));
  EXPECT_TRUE(std::is_sorted(top, played.end(), std::greater<>()));
}

TEST(EvenWaveform, ManyAwkwardPointsMeetTheGridAsWellAsItsRoomAllows) {
  PointsFile points;
  for (int i = 0; i <= 5000; ++i) {
    const double phase = i == 5000 ? 1 : (i + 0.3 * std::sin(7.0 * i)) / 5000;
    points.phase.push_back(i == 0 ? 0 : phase);
    points.fraction.push_back((1 - std::cos(2 * M_PI * points.phase.back())) / 2);
  }
  const EvenWaveform even = on_even_phases(points, 4096);
  EXPECT_LE(even.rises.size(), 4096U);
  EXPECT_LE(even.off_grid, 0.5 / 2048);
  const std::vector<double> played = even.fractions();
  for (size_t i = 0; i < played.size(); ++i) {
    const double phase = static_cast<double>(i) / static_cast<double>(even.rises.size());
    EXPECT_NEAR(played[i], (1 - std::cos(2 * M_PI * phase)) / 2, 1e-5);
  }
}

std::string experiment_of(int segments) {
  std::string text = "format = \"diastole-experiment\"\nversion = 1\n";
  for (int i = 0; i < segments; ++i)
    text += "[[segment]]\nwaveform = \"uploaded\"\npoints = \"w" + std::to_string(i) +
            ".csv\"\nstroke_mL = 10\nperiod_s = 1\n";
  return text;
}

std::string even_text(int intervals) {
  std::string text = "time_s,volume_mL\n";
  for (int i = 0; i <= intervals; ++i)
    text += std::to_string(i) + "," + std::to_string(std::min(i, intervals - i)) + "\n";
  return text;
}

TEST(UploadedSegment, TakesStrokeAndPeriodFromThePointsUnlessTold) {
  const std::string text =
      "format = \"diastole-experiment\"\nversion = 1\n[[segment]]\nwaveform = \"uploaded\"\npoints = "
      "\"p.csv\"\n"
      "[[segment]]\nwaveform = \"uploaded\"\npoints = \"p.csv\"\nstroke_mL = 7\nperiod_s = 2.5\n";
  const Experiment experiment =
      parse_experiment(text, "x", [](const std::string&) { return "time_s,volume_mL\n0,1\n0.5,4\n0.9,1\n"; });
  ASSERT_EQ(experiment.waveforms.size(), 1U) << "one file, one waveform";
  EXPECT_DOUBLE_EQ(experiment.segments[0].stroke_mL, 3);
  EXPECT_DOUBLE_EQ(experiment.segments[0].period_s, 0.9);
  EXPECT_DOUBLE_EQ(experiment.segments[1].stroke_mL, 7);
  EXPECT_DOUBLE_EQ(experiment.segments[1].period_s, 2.5);
  EXPECT_EQ(experiment.segments[1].upload, 0U);
}

TEST(UploadedSegment, WhatTheControllerCannotHoldIsRefusedAtItsPlace) {
  const auto refusal = [](int segments, int intervals) {
    return message_of<InputError>([&] {
      parse_experiment(experiment_of(segments), "x.toml",
                       [&](const std::string&) { return even_text(intervals); });
    });
  };
  EXPECT_THAT(refusal(9, 10),
              AllOf(HasSubstr("segment[8].points"), HasSubstr("number 9"), HasSubstr("holds 8")));
  EXPECT_THAT(refusal(3, 2000), AllOf(HasSubstr("segment[2].points"), HasSubstr("4096")));
  EXPECT_THAT(message_of<InputError>([] { parse_experiment(experiment_of(1), "x.toml"); }),
              HasSubstr("segment[0].points"));
}

TEST(UploadedSegment, UnevenWaveformsShareTheRoom) {
  const Experiment experiment = parse_experiment(experiment_of(3), "x", [](const std::string& name) {
    return name == "w1.csv" ? even_text(3000) : "phase,fraction\n0,0\n0.37,1\n1,0\n";
  });
  EXPECT_EQ(experiment.waveforms[1].even.rises.size(), 3000U);
  EXPECT_LE(experiment.waveforms[0].even.rises.size(), 548U);
  EXPECT_GE(experiment.waveforms[0].even.rises.size(), 274U);
}

}  // namespace
}  // namespace diastole
