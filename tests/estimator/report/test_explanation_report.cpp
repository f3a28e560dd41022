#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/report/explanation_drawings.hpp"
#include "estimator/report/field_views.hpp"
#include "estimator/report/report.hpp"
#include "estimator/report/svg_plot.hpp"
#include "estimator/report/trace_views.hpp"
#include "tests/estimator/explain/synthetic_explanation.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::report {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

explain::Trace sine(double frequency_Hz, double amplitude) {
  explain::Trace trace;
  trace.run = "a.run.h5";
  trace.noise_sd = 0.5;
  for (int i = 0; i < 4000; ++i) {
    const double t = i / 100.0;
    trace.time_s.push_back(t);
    trace.measured.push_back(amplitude * std::sin(2 * std::numbers::pi * frequency_Hz * t));
  }
  trace.before.assign(4000, 0.0);
  trace.after = trace.measured;
  trace.trigger_s = {2.0, 4.0, 6.0, 8.0, 20.0};
  return trace;
}

TEST(TraceViews, CutIntoCyclesAtTheTriggers) {
  const auto cycles = cycles_of(sine(1.0, 1.0));
  ASSERT_EQ(cycles.size(), 5U);
  EXPECT_EQ(cycles[0].first, 200U);
  EXPECT_EQ(cycles[0].last, 400U);
  EXPECT_NEAR(cycles[3].period_s, 12.0, 1e-12);
  EXPECT_EQ(cycles[4].last, 3200U);
  explain::Trace untriggered = sine(1.0, 1.0);
  untriggered.trigger_s.clear();
  EXPECT_EQ(cycles_of(untriggered).size(), 1U);
}

TEST(TraceViews, ASinesPowerStandsAtItsFrequency) {
  const Spectrum spectrum = residual_spectrum(sine(3.0, 0.2), sine(3.0, 0.2).before);
  const auto top = std::ranges::max_element(spectrum.density) - spectrum.density.begin();
  EXPECT_NEAR(spectrum.frequency_Hz[static_cast<size_t>(top)], 3.0, 1e-9);
  double power = 0.0;
  const double spacing_Hz = spectrum.frequency_Hz[1] - spectrum.frequency_Hz[0];
  for (const double density : spectrum.density)
    power += density * density * spacing_Hz;
  EXPECT_NEAR(power, 0.02, 0.0005);  // half the square of the amplitude
}

TEST(TraceViews, RepeatsOfEqualCyclesShowTheNoiseOnly) {
  const explain::Explanation explained = test::explained_hose();
  const Spectrum floor = repeat_spectrum(explained.traces[0]);
  const Spectrum before = residual_spectrum(explained.traces[0], explained.traces[0].before);
  double noise = 0.0;
  for (const double density : floor.density)
    noise += density * density / static_cast<double>(floor.density.size());
  // White noise of 0.03 at 100 Hz has the density 0.03 sqrt(2/100).
  EXPECT_NEAR(std::sqrt(noise), 0.03 * std::sqrt(0.02), 0.0008);
  EXPECT_GT(std::ranges::max(before.density), 20 * std::sqrt(noise));
}

TEST(TraceViews, TheMeanCycleIsThatOfTheWorstGroup) {
  const explain::Trace trace = sine(0.5, 1.0);
  const MeanCycle mean = worst_mean_cycle(trace, 40);
  EXPECT_EQ(mean.cycles, 3U);
  EXPECT_NEAR(mean.measured[10], 1.0, 0.02);
  const auto grid = residual_grid(trace, trace.before, 4);
  ASSERT_EQ(grid.size(), 5U);
  EXPECT_NEAR(grid[0][0], 2 / std::numbers::pi / 0.5, 0.03);
  EXPECT_NEAR(misfit_in_noise(trace, trace.before), std::sqrt(0.5) / 0.5, 0.01);
}

TEST(FieldViews, ShowALumpWhereItIs) {
  const double theta = std::numbers::pi / 3;
  const auto views = field_views(test::explained_inclusion().field,
                                 {{28.0 * std::cos(theta), 28.0 * std::sin(theta), 10.0}});
  ASSERT_EQ(views.size(), 4U);
  ASSERT_EQ(views[0].marks.size(), 1U);
  EXPECT_NEAR(views[0].marks[0][0], 60.0, 1e-9);
  EXPECT_EQ(views[0].marks[0][1], 10.0);
  EXPECT_TRUE(views[1].marks.empty());
  EXPECT_EQ(views[3].marks.size(), 1U);
  const CellGrid& inner = views[0].before;
  double worst = 0.0;
  size_t row = 0, column = 0;
  for (size_t r = 0; r < inner.size(); ++r) {
    for (size_t c = 0; c < inner[r].size(); ++c) {
      if (!(inner[r][c] > worst)) continue;
      worst = inner[r][c];
      row = r;
      column = c;
    }
  }
  const auto columns = static_cast<double>(inner[0].size()), rows = static_cast<double>(inner.size());
  EXPECT_NEAR(-180 + 360 * (static_cast<double>(column) + 0.5) / columns, 60.0, 180 / columns + 1);
  EXPECT_NEAR(42.5 - 85 * (static_cast<double>(row) + 0.5) / rows, 10.0, 43 / rows + 3);
  EXPECT_GT(worst, 5.0);
  EXPECT_GT(rms_of(test::explained_inclusion().field)[0], rms_of(test::explained_inclusion().field)[1]);
}

TEST(FieldViews, ShowOneWhereNoiseIsAll) {
  double squares = 0.0;
  double cells = 0.0;
  for (const FieldView& view : field_views(test::explained_inclusion().field)) {
    for (const auto& row : view.after) {
      for (const double value : row) {
        squares += value * value;
        ++cells;
      }
    }
  }
  EXPECT_NEAR(squares / cells, 1.0, 0.15);
}

TEST(HeatMap, LeavesHolesAndShowsTheScale) {
  const double nan = std::nan("");
  const std::string svg =
      heat_map({{1, nan}, {-3, 2}}, {{0, 0}, {0, nan}},
               {.x = "phase", .y = "cycle", .bar = "σ", .x_range = {0, 1}, .y_range = {0, 2}});
  EXPECT_THAT(svg, HasSubstr(">before<"));
  EXPECT_THAT(svg, HasSubstr(">after<"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(Waterfall, NamesEachStep) {
  const std::string svg = waterfall({{"", 812.0}, {"seal-leak-pump", 4.0}, {"sensor-drift", 1.02}}, 1.0);
  EXPECT_THAT(svg, HasSubstr(">base model<"));
  EXPECT_THAT(svg, HasSubstr(">+ seal-leak-pump<"));
  EXPECT_THAT(svg, HasSubstr(">1.02<"));
}

TEST(LogarithmicAxis, TicksAtDecadesAndTheirParts) {
  EXPECT_THAT(
      decades_over(0.03, 2.0),
      ElementsAre(testing::DoubleEq(0.01), testing::DoubleEq(0.02), testing::DoubleEq(0.05),
                  testing::DoubleEq(0.1), testing::DoubleEq(0.2), testing::DoubleEq(0.5), 1, 2, 5, 10));
  EXPECT_EQ(decades_over(1e-3, 1e3).size(), 7U);
  SvgPlot plot({.x = {.label = "x", .logarithmic = true}, .y = {.label = "y", .logarithmic = true}});
  plot.line(std::vector<double>{0.0, 1.0, 10.0}, std::vector<double>{5.0, -1.0, 100.0}, "a");
  EXPECT_THAT(plot.svg(), Not(HasSubstr("nan")));
  EXPECT_THAT(plot.svg(), Not(HasSubstr("inf")));
}

TEST(ExplanationReport, ReportsEveryPartOfAnExplanation) {
  const test::ScratchFolder folder;
  const auto file = folder.write("explanation.json", to_json(test::explained_hose()));
  const std::string page = make_report(std::vector{file});
  for (const char* text : {"Where model and measurement disagree: gel", "hose-compliance", "14.2 → 1.1",
                           "soft hose", "The gap, effect by effect", "Pressure against the volume",
                           "no model can go below it", "residual / noise", "8.780 ± 0.040", "−9.7 %",
                           "61.2 ± 2.1 m/s", "The evidence", "refuted: predicts the sweep worse by 1110",
                           "What to measure next", "waveform = &quot;sinusoidal&quot;",
                           "explained.study.toml", "held out", "segment 2, 0.40 to 0.60 of the cycle"})
    EXPECT_THAT(page, HasSubstr(text));
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_THAT(page, Not(HasSubstr("=\"nan")));
  EXPECT_EQ(make_report(explain::explanation_from_json(to_json(test::explained_hose()), "explanation.json")),
            page);
}

TEST(ExplanationReport, ShowsTheWallAndEscapesNames) {
  const std::string page = make_report(test::explained_inclusion());
  EXPECT_THAT(page, HasSubstr("The inner third of the wall, unrolled"));
  EXPECT_THAT(page, HasSubstr("Across the axis at z ="));
  EXPECT_THAT(page, HasSubstr("around 60 deg"));
  EXPECT_THAT(page, HasSubstr("gel &lt;2&gt;"));
}

TEST(ExplanationReport, EveryVerdictHasItsWords) {
  explain::Explanation none;
  none.study = "a.study.toml";
  EXPECT_THAT(make_report(none), HasSubstr("nothing exceeds the noise"));
  none.model_error = explain::ModelErrorSize{"stated", 30.0, 0.5};
  EXPECT_THAT(make_report(none), HasSubstr("nothing exceeds the model's own error"));
  explain::Explanation ambiguous = test::explained_hose();
  ambiguous.verdict = explain::Verdict::ambiguous;
  ambiguous.ambiguous_with = {{"air-bubble-pump"}, {"viscoelasticity", "sensor-gain"}};
  EXPECT_THAT(make_report(ambiguous),
              HasSubstr("As good on these data: air-bubble-pump; or viscoelasticity + sensor-gain"));
  explain::Explanation unexplained = none;
  unexplained.verdict = explain::Verdict::unexplained;
  EXPECT_THAT(make_report(unexplained), HasSubstr("no known effect removes"));
}

}  // namespace
}  // namespace diastole::report
