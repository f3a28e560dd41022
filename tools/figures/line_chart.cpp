#include "tools/figures/line_chart.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>

namespace diastole {
namespace {

constexpr double width = 720.0;
constexpr double height = 480.0;
constexpr double left = 70.0;
constexpr double right = 20.0;
constexpr double top = 40.0;
constexpr double bottom = 60.0;
// Distinguishable in print and by colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 7> colours{"#000000", "#e69f00", "#56b4e9", "#009e73",
                                             "#d55e00", "#0072b2", "#cc79a7"};
constexpr std::array<const char*, 4> dashes{"none", "8 4", "2 3", "10 3 2 3"};

ChartPoint on_page(const LineChart& chart, const ChartPoint& p) {
  return {left + (width - left - right) * (p.x - chart.least.x) / (chart.most.x - chart.least.x),
          height - bottom - (height - top - bottom) * (p.y - chart.least.y) / (chart.most.y - chart.least.y)};
}

std::string axes(const LineChart& chart) {
  std::string svg = fmt::format(
      "<rect x='{}' y='{}' width='{}' height='{}' fill='none' stroke='#444'/>\n"
      "<text x='{}' y='24' text-anchor='middle' font-size='16'>{}</text>\n"
      "<text x='{}' y='{}' text-anchor='middle'>{}</text>\n"
      "<text transform='translate(20 {}) rotate(-90)' text-anchor='middle'>{}</text>\n",
      left, top, width - left - right, height - top - bottom, width / 2, chart.title,
      (width + left - right) / 2, height - 18, chart.x_label, (height + top - bottom) / 2, chart.y_label);
  const auto count = [](double range, double tick) {
    return static_cast<int>(std::floor(range / tick + 1e-9));
  };
  for (int i = 0; i <= count(chart.most.x - chart.least.x, chart.tick.x); ++i) {
    const double x = chart.least.x + i * chart.tick.x;
    const ChartPoint at = on_page(chart, {x, chart.least.y});
    svg += fmt::format(
        "<path d='M{:.1f} {:.1f}v6' stroke='#444'/><text x='{:.1f}' y='{:.1f}' "
        "text-anchor='middle'>{:g}</text>\n",
        at.x, at.y, at.x, at.y + 20, x);
  }
  for (int i = 0; i <= count(chart.most.y - chart.least.y, chart.tick.y); ++i) {
    const double y = chart.least.y + i * chart.tick.y;
    const ChartPoint at = on_page(chart, {chart.least.x, y});
    svg += fmt::format(
        "<path d='M{:.1f} {:.1f}h-6' stroke='#444'/><text x='{:.1f}' y='{:.1f}' "
        "text-anchor='end'>{:g}</text>\n",
        at.x, at.y, at.x - 9, at.y + 4, y);
  }
  return svg;
}

std::string curve(const LineChart& chart, const ChartSeries& series, size_t number) {
  const char* colour = colours[number % colours.size()];
  std::string svg;
  if (series.markers_only) {
    for (const ChartPoint& point : series.points) {
      const ChartPoint at = on_page(chart, point);
      svg +=
          fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='5' fill='none' stroke='{}' stroke-width='1.5'/>\n",
                      at.x, at.y, colour);
    }
    return svg;
  }
  svg = "<polyline points='";
  for (const ChartPoint& point : series.points) {
    const ChartPoint at = on_page(chart, point);
    svg += fmt::format("{:.2f},{:.2f} ", at.x, at.y);
  }
  return svg + fmt::format("' fill='none' stroke='{}' stroke-width='1.8' stroke-dasharray='{}'/>\n", colour,
                           dashes[number % dashes.size()]);
}

std::string legend(const LineChart& chart) {
  constexpr double entry = 20.0;
  std::string svg;
  for (size_t n = 0; n < chart.series.size(); ++n) {
    const double y = top + 20.0 + entry * static_cast<double>(n);
    const double x = width - right - 190.0;
    const char* colour = colours[n % colours.size()];
    svg += chart.series[n].markers_only
               ? fmt::format("<circle cx='{}' cy='{}' r='5' fill='none' stroke='{}' stroke-width='1.5'/>",
                             x + 18, y, colour)
               : fmt::format("<path d='M{} {}h36' stroke='{}' stroke-width='1.8' stroke-dasharray='{}'/>", x,
                             y, colour, dashes[n % dashes.size()]);
    svg += fmt::format("<text x='{}' y='{}'>{}</text>\n", x + 44, y + 4, chart.series[n].label);
  }
  return svg;
}

}  // namespace

std::string to_svg(const LineChart& chart) {
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' font-family='sans-serif' font-size='13'>\n"
      "<rect width='100%' height='100%' fill='white'/>\n",
      width, height);
  svg += axes(chart);
  for (size_t n = 0; n < chart.series.size(); ++n)
    svg += curve(chart, chart.series[n], n);
  return svg + legend(chart) + "</svg>\n";
}

}  // namespace diastole
