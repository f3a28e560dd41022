#include "estimator/report/explanation_drawings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr double panel_width = 440, panel_height = 210, panel_gap = 20;
constexpr double left_room = 58, top_room = 24, bottom_room = 44;
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

constexpr double label_letter_width = 6.8, bar_room = 640, value_room = 70, row_height = 34, bar_height = 20,
                 bars_foot = 46;

std::string name_of(const explain::Step& step, bool first) {
  return first && step.added.empty() ? "base model" : "+ " + step.added;
}

}  // namespace

std::string heat_map(const CellGrid& before, const CellGrid& after, const HeatMapLabels& labels) {
  const ColourScale scale{range_of(before, after, labels.is_signed),
                          labels.is_signed ? signed_colour : map_colour, 40};
  const double second = left_room + panel_width + panel_gap;
  const ColourBarPlace bar{second + panel_width + bar_gap, top_room, panel_height};
  return drawing(
      bar.left + bar.width + bar.room, top_room + panel_height + bottom_room,
      fmt::format("<g transform=\"translate({0} {2})\">{3}</g><g transform=\"translate({1} {2})\">{4}</g>{5}",
                  left_room, second, top_room, panel(before, scale, labels, "before", true),
                  panel(after, scale, labels, "after", false), colour_bar(scale, labels.bar, bar)));
}

std::string waterfall(const std::vector<explain::Step>& steps, double floor) {
  double least = floor, most = floor;
  size_t letters = 0;
  for (const explain::Step& step : steps) {
    letters = std::max(letters, name_of(step, &step == &steps.front()).size());
    least = std::min(least, step.reduced_chi_square);
    most = std::max(most, step.reduced_chi_square);
  }
  // Bars begin at half the floor, so that a step at the floor still has one.
  const double bars_left = 14 + label_letter_width * static_cast<double>(letters);
  const double from = std::max(0.5 * least, 1e-3);
  const double to = std::max(1.15 * most, 4 * from);
  const auto px = [&](double value) {
    return bars_left + bar_room * std::log(std::max(value, from) / from) / std::log(to / from);
  };
  const double bars_bottom = row_height * static_cast<double>(steps.size()) + 8;
  std::string body;
  for (const double tick : decades_over(from, to)) {
    if (tick < from || tick > to) continue;
    body += fmt::format(
        "<path class=\"grid\" d=\"M{0:.1f} 0V{1}\"/><text x=\"{0:.1f}\" y=\"{2}\" "
        "text-anchor=\"middle\">{3}</text>",
        px(tick), bars_bottom, bars_bottom + 17, chosen(tick));
  }
  for (size_t i = 0; i < steps.size(); ++i) {
    const double value = steps[i].reduced_chi_square;
    const double y = row_height * static_cast<double>(i) + 8;
    body += fmt::format("<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                        bars_left - 10, y + 15, escaped(name_of(steps[i], i == 0)));
    double end = px(value);
    if (i > 0) {
      const double previous = px(steps[i - 1].reduced_chi_square);
      body += fmt::format("<rect class=\"band {}\" x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\"/>",
                          previous > end ? "c" : "b", std::min(end, previous), y, std::abs(previous - end),
                          bar_height);
      end = std::max(end, previous);
    }
    body += fmt::format(
        "<rect class=\"bars {}\" x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\"/><text class=\"label\" "
        "x=\"{:.1f}\" y=\"{}\">{}</text>",
        i == 0 ? "b" : "a", bars_left, y, px(value) - bars_left, bar_height, end + 8, y + 15,
        number(value, 3));
  }
  body += fmt::format("<path class=\"mark c\" d=\"M{0:.1f} 0V{1}\"/>", px(floor), bars_bottom);
  body += fmt::format(
      "<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">reduced chi-square on data that were "
      "not fitted; dashed: noise</text>",
      bars_left + bar_room / 2, bars_bottom + 38);
  return drawing(bars_left + bar_room + value_room, bars_bottom + bars_foot, body);
}

}  // namespace diastole::report
