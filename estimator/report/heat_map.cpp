#include "estimator/report/heat_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr double panel_width = 440, panel_height = 210, panel_gap = 20;
constexpr double left = 58, top = 24, bottom = 44;
constexpr double bar_gap = 18, bar_width = 14, bar_room = 58;
constexpr int shades = 40;

std::string shade(double fraction, bool is_signed) {
  if (!is_signed) return map_colour(fraction);
  constexpr std::array<double, 3> blue{33, 102, 172}, white{247, 247, 247}, red{178, 24, 43};
  const std::array<double, 3>& end = fraction < 0.5 ? blue : red;
  const double part = std::abs(2 * fraction - 1);
  std::string colour = "#";
  for (size_t i = 0; i < 3; ++i)
    colour += fmt::format("{:02x}", std::lround(std::lerp(white[i], end[i], part)));
  return colour;
}

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

/// Cells of one colour are one path.
std::string cells(const CellGrid& grid, const std::array<double, 2>& range, bool is_signed) {
  std::map<int, std::string> paths;
  const double height = panel_height / static_cast<double>(std::max<size_t>(grid.size(), 1));
  for (size_t r = 0; r < grid.size(); ++r) {
    const double width = panel_width / static_cast<double>(grid[r].size());
    for (size_t c = 0; c < grid[r].size(); ++c) {
      if (!std::isfinite(grid[r][c])) continue;
      const double fraction = std::clamp((grid[r][c] - range[0]) / (range[1] - range[0]), 0.0, 1.0);
      const int bin = std::min(shades - 1, static_cast<int>(fraction * shades));
      fmt::format_to(std::back_inserter(paths[bin]), "M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z",
                     width * static_cast<double>(c), height * static_cast<double>(r), width, height, -width);
    }
  }
  std::string result;
  for (const auto& [bin, path] : paths) {
    result += fmt::format("<path fill=\"{0}\" stroke=\"{0}\" stroke-width=\".3\" d=\"{1}\"/>",
                          shade((bin + 0.5) / shades, is_signed), path);
  }
  return result;
}

std::string panel(const CellGrid& grid, const std::array<double, 2>& range, const HeatMapLabels& labels,
                  const char* title, bool has_y_ticks) {
  std::string body =
      fmt::format("<text x=\"{}\" y=\"-8\" text-anchor=\"middle\">{}</text>", panel_width / 2, title);
  body += cells(grid, range, labels.is_signed);
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

std::string colour_bar(const std::array<double, 2>& range, const HeatMapLabels& labels) {
  std::string body;
  const double step = panel_height / shades;
  for (int i = 0; i < shades; ++i) {
    body += fmt::format("<path stroke=\"{}\" stroke-width=\"{:.2f}\" d=\"M0 {:.2f}h{}\"/>",
                        shade((i + 0.5) / shades, labels.is_signed), step + 0.3,
                        panel_height - (i + 0.5) * step, bar_width);
  }
  for (const double tick : ticks_over(range[0], range[1], 5)) {
    if (tick < range[0] - 1e-9 || tick > range[1] + 1e-9) continue;
    body += fmt::format("<text x=\"{}\" y=\"{:.1f}\">{}</text>", bar_width + 6,
                        panel_height * (range[1] - tick) / (range[1] - range[0]) + 4,
                        chosen(std::abs(tick) < 1e-9 ? 0.0 : tick));
  }
  return body + fmt::format("<text class=\"label\" x=\"{}\" y=\"-8\" text-anchor=\"end\">{}</text>",
                            bar_width + bar_room, escaped(labels.bar));
}

}  // namespace

std::string heat_map(const CellGrid& before, const CellGrid& after, const HeatMapLabels& labels) {
  const std::array<double, 2> range = range_of(before, after, labels.is_signed);
  const double second = left + panel_width + panel_gap;
  const double bar = second + panel_width + bar_gap;
  return fmt::format(
      "<svg class=\"plot\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" role=\"img\">"
      "<g transform=\"translate({2} {6})\">{3}</g><g transform=\"translate({4} {6})\">{5}</g>"
      "<g transform=\"translate({7} {6})\">{8}</g></svg>",
      bar + bar_width + bar_room, top + panel_height + bottom, left,
      panel(before, range, labels, "before", true), second, panel(after, range, labels, "after", false), top,
      bar, colour_bar(range, labels));
}

}  // namespace diastole::report
