#include "estimator/report/heat_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr double panel_width = 440, panel_height = 210, panel_gap = 20;
constexpr double left = 58, top = 24, bottom = 44;
constexpr double bar_gap = 18;

std::array<double, 2> range_of(const CellGrid& before, const CellGrid& after, bool is_signed) {
  std::vector<double> sizes;
  for (const CellGrid* grid : {&before, &after}) {
    for (const auto& row : *grid) {
      for (const double value : row)
        if (std::isfinite(value)) sizes.push_back(std::abs(value));
    }
  }
  sizes.push_back(2.0);
  std::ranges::sort(sizes);
  const double most =
      std::max(2.0, sizes[static_cast<size_t>(std::ceil(0.995 * static_cast<double>(sizes.size() - 1)))]);
  return {is_signed ? -most : 0.0, most};
}

std::string cells(const CellGrid& grid, const ColourScale& scale) {
  CellPainter painter(scale);
  const double height = panel_height / static_cast<double>(std::max<size_t>(grid.size(), 1));
  for (size_t r = 0; r < grid.size(); ++r) {
    const double width = panel_width / static_cast<double>(grid[r].size());
    for (size_t c = 0; c < grid[r].size(); ++c)
      painter.add(grid[r][c],
                  fmt::format("M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z", width * static_cast<double>(c),
                              height * static_cast<double>(r), width, height, -width));
  }
  return painter.svg(0.3);
}

std::string panel(const CellGrid& grid, const ColourScale& scale, const HeatMapLabels& labels,
                  const char* title, bool has_y_ticks) {
  std::string body =
      fmt::format("<text x=\"{}\" y=\"-8\" text-anchor=\"middle\">{}</text>", panel_width / 2, title);
  body += cells(grid, scale);
  body += fmt::format("<path class=\"grid\" d=\"M0 0h{}v{}h-{}z\"/>", panel_width, panel_height, panel_width);
  for (const auto& [x, y] : labels.marks) {
    body += fmt::format("<circle class=\"ring\" r=\"9\" cx=\"{:.1f}\" cy=\"{:.1f}\"/>",
                        panel_width * (x - labels.x_range[0]) / (labels.x_range[1] - labels.x_range[0]),
                        panel_height * (y - labels.y_range[0]) / (labels.y_range[1] - labels.y_range[0]));
  }
  for (const double tick : ticks_over(labels.x_range[0], labels.x_range[1], 6)) {
    const double x = panel_width * (tick - labels.x_range[0]) / (labels.x_range[1] - labels.x_range[0]);
    if (x < -1e-6 || x > panel_width + 1e-6) continue;
    body += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>", x, panel_height + 17,
                        chosen(std::abs(tick) < 1e-9 ? 0.0 : tick));
  }
  body += fmt::format("<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                      panel_width / 2, panel_height + 38, escaped(labels.x));
  if (!has_y_ticks) return body;
  const double low = std::min(labels.y_range[0], labels.y_range[1]);
  const double high = std::max(labels.y_range[0], labels.y_range[1]);
  for (const double tick : ticks_over(low, high, 5)) {
    if (tick < low - 1e-9 || tick > high + 1e-9) continue;
    const double y = panel_height * (tick - labels.y_range[0]) / (labels.y_range[1] - labels.y_range[0]);
    body += fmt::format("<text x=\"-7\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", y + 4,
                        chosen(std::abs(tick) < 1e-9 ? 0.0 : tick));
  }
  return body + fmt::format(
                    "<text class=\"label\" transform=\"translate(-44 {}) rotate(-90)\" "
                    "text-anchor=\"middle\">{}</text>",
                    panel_height / 2, escaped(labels.y));
}

}  // namespace

std::string heat_map(const CellGrid& before, const CellGrid& after, const HeatMapLabels& labels) {
  const ColourScale scale{range_of(before, after, labels.is_signed),
                          labels.is_signed ? signed_colour : map_colour, 40};
  const double second = left + panel_width + panel_gap;
  const ColourBarPlace bar{second + panel_width + bar_gap, top, panel_height};
  return drawing(
      bar.left + bar.width + bar.room, top + panel_height + bottom,
      fmt::format("<g transform=\"translate({0} {2})\">{3}</g><g transform=\"translate({1} {2})\">"
                  "{4}</g>{5}",
                  left, second, top, panel(before, scale, labels, "before", true),
                  panel(after, scale, labels, "after", false), colour_bar(scale, labels.bar, bar)));
}

}  // namespace diastole::report
