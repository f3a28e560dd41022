#include <gmock/gmock.h>

#include <limits>

#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(Ticks, AreRoundAndCoverTheData) {
  EXPECT_THAT(ticks_over(0.0, 1.0, 5), ElementsAre(0, DoubleNear(0.2, 1e-12), DoubleNear(0.4, 1e-12),
                                                   DoubleNear(0.6, 1e-12), DoubleNear(0.8, 1e-12), 1));
  EXPECT_THAT(ticks_over(-3.2, 41.0, 5), ElementsAre(-10, 0, 10, 20, 30, 40, 50));
  EXPECT_THAT(ticks_over(1000.0, 1003.0, 3), ElementsAre(1000, 1001, 1002, 1003));
}

TEST(SvgPlot, PutsDataWhereTheAxesSay) {
  SvgPlot plot({.x = {.label = "time (s)"}, .y = {.label = "pressure (kPa)"}, .width = 176, .height = 158});
  const double x[] = {0, 10}, y[] = {0, 100};
  plot.line(x, y, "a");
  // The plot's area is 100 x 100 with its lower left corner at (62, 112).
  EXPECT_THAT(plot.svg(), HasSubstr("d=\"M62.0 112.0L162.0 12.0\""));
  EXPECT_THAT(plot.svg(), HasSubstr("time (s)"));
}

TEST(SvgPlot, ANaNBreaksALineAndNoDataIsNoFault) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SvgPlot plot({});
  const double x[] = {0, 1, 2, 3, 4}, y[] = {0, 1, nan, 1, 0};
  plot.line(x, y, "a");
  EXPECT_THAT(plot.svg(), Not(HasSubstr("nan")));
  EXPECT_THAT(SvgPlot({}).svg(), HasSubstr("</svg>"));
}

TEST(SvgPlot, TextFromFilesIsEscaped) {
  SvgPlot plot({.x = {.label = "<script>"}, .y = {}});
  EXPECT_THAT(plot.svg(), Not(HasSubstr("<script>")));
}

TEST(HtmlText, NumbersReadWell) {
  EXPECT_EQ(with_error(8.5692, 0.0877), "8.569 \u00b1 0.088");
  EXPECT_EQ(with_error(123.4, 21.0), "123 \u00b1 21");
  EXPECT_EQ(number(0.79436, 3), "0.794");
  EXPECT_EQ(number(-1.5, 2), "\u22121.5");
  EXPECT_EQ(number(std::numeric_limits<double>::quiet_NaN()), "\u2013");
  EXPECT_EQ(chosen(0.25), "0.25");
  EXPECT_EQ(chosen(40), "40");
  EXPECT_EQ(escaped("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
}

}  // namespace
}  // namespace diastole::report
