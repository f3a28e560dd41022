#include "tools/benchmarks/verification/line_chart.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>

#include "estimator/report/page.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole {

std::string to_svg(const LineChart& chart) {
  constexpr std::array<const char*, 10> styles{"a",        "b",        "c",      "muted heavy", "a dashed",
                                               "b dashed", "c dashed", "a thin", "b thin",      "c thin"};
  report::SvgPlot plot({.x = {.label = chart.x_label, .from = chart.least.x, .to = chart.most.x},
                        .y = {.label = chart.y_label, .from = chart.least.y, .to = chart.most.y},
                        .width = 720,
                        .height = 480});
  for (size_t i = 0; i < chart.series.size(); ++i) {
    const ChartSeries& series = chart.series[i];
    const auto x = report::numbers_of(series.points, &ChartPoint::x);
    const auto y = report::numbers_of(series.points, &ChartPoint::y);
    const char* style = styles[i % styles.size()];
    if (series.markers_only) {
      plot.points(x, y, style, series.label);
    } else {
      plot.line(x, y, style, series.label);
    }
  }
  return report::standalone(plot.svg(), chart.title);
}

int write_figure(int argc, char** argv, const char* program, LineChart (*make)()) {
  if (argc != 2) {
    fmt::print(stderr, "usage: {} FIGURE.svg > TABLE.md\n", program);
    return 2;
  }
  const std::string svg = to_svg(make());
  std::ofstream file(argv[1]);
  file << svg;
  if (file.flush()) return 0;
  fmt::print(stderr, "{}: {} cannot be written\n", program, argv[1]);
  return 2;
}

}  // namespace diastole
