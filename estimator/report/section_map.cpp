#include "estimator/report/section_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr double state_width = 225, state_gap = 16, largest_height = 400;
constexpr double title_height = 24, foot_height = 30;
constexpr double bar_left = 2 * state_width + 2 * state_gap;

/// Places of both states on one scale.
struct Scale {
  double left_mm, top_mm, px_per_mm, height;

  [[nodiscard]] double px(double h_mm) const { return (h_mm - left_mm) * px_per_mm; }
  [[nodiscard]] double py(double v_mm) const { return title_height + (top_mm - v_mm) * px_per_mm; }
};

Scale scale_of(const SolutionSection& section) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  std::array<double, 2> low{inf, inf};
  std::array<double, 2> high{-inf, -inf};
  for (const FlatPoints* points : {&section.outline_before, &section.outline_after}) {
    for (size_t i = 0; i < points->size(); ++i) {
      low[i & 1] = std::min(low[i & 1], (*points)[i]);
      high[i & 1] = std::max(high[i & 1], (*points)[i]);
    }
  }
  if (!(low[0] < high[0] && low[1] < high[1])) return {0, 0, 1, 0};
  const double margin = 2.0;  // px, for the strokes
  const double scale =
      std::min((state_width - 2 * margin) / (high[0] - low[0]), largest_height / (high[1] - low[1]));
  const double spare_mm = 0.5 * (state_width / scale - (high[0] - low[0]));
  return {low[0] - spare_mm, high[1] + margin / scale, scale, (high[1] - low[1]) * scale + 2 * margin};
}

/// Polygons (closed), or single lines of two points each, in whole tenths of a pixel and relative steps.
std::string path_of(const FlatPoints& points, bool closed, const Scale& scale) {
  std::string text;
  std::array<long, 2> before{};
  for (size_t i = 0; i + 1 < points.size(); i += 2) {
    const std::array<long, 2> at{std::lround(10 * scale.px(points[i])),
                                 std::lround(10 * scale.py(points[i + 1]))};
    const bool begins = closed ? i == 0 : i % 4 == 0;
    if (begins) before = {};
    fmt::format_to(std::back_inserter(text), "{}{:g} {:g}", begins ? 'M' : 'l',
                   0.1 * static_cast<double>(at[0] - before[0]),
                   0.1 * static_cast<double>(at[1] - before[1]));
    before = at;
  }
  return closed ? text + 'z' : text;
}

std::string panel(const std::vector<FlatPoints>& cells, const std::vector<double>& values,
                  const ColourScale& colours, const Scale& scale) {
  CellPainter painter(colours);
  for (size_t i = 0; i < cells.size(); ++i)
    painter.add(values[i], path_of(cells[i], true, scale));
  return painter.svg(0.6);
}

std::string lines(const FlatPoints& points, const char* style, const Scale& scale) {
  return fmt::format("<path class=\"{}\" d=\"{}\"/>", style, path_of(points, false, scale));
}

/// A bar of a round length under the first drawing.
std::string length_bar(const SolutionSection& section, const Scale& scale) {
  const double length_mm = ticks_over(0, 0.5 * state_width / scale.px_per_mm, 1)[1];
  const double length = length_mm * scale.px_per_mm;
  const double x = 0.5 * (state_width - length);
  const double y = title_height + scale.height + 10;
  return fmt::format(
      "<path class=\"ruler\" d=\"M{0:.1f} {1:.1f}v6m0 -3h{2:.1f}m0 -3v6\"/>"
      "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\">{5} mm</text>"
      "<text x=\"{6:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\">→ {7}, ↑ {8}</text>",
      x, y, length, x + 0.5 * length, y + 18, chosen(length_mm), 1.5 * state_width + state_gap,
      escaped(section.horizontal.substr(0, section.horizontal.find(' '))),
      escaped(section.vertical.substr(0, section.vertical.find(' '))));
}

}  // namespace

std::string section_map(const SolutionSection& section, const NamedField& field, const std::string& bar_label,
                        const std::string& after_title) {
  const Scale scale = scale_of(section);
  const ColourScale colours{colour_range(field.values)};
  const double after = state_width + state_gap;
  const ColourBarPlace bar{bar_left, title_height, scale.height};
  std::string body =
      fmt::format("<text x=\"{}\" y=\"14\" text-anchor=\"middle\">undeformed</text>", 0.5 * state_width);
  body += panel(section.cells_before, field.values, colours, scale);
  body +=
      lines(section.elements_before, "element-line", scale) + lines(section.outline_before, "outline", scale);
  body +=
      fmt::format("<g transform=\"translate({} 0)\"><text x=\"{}\" y=\"14\" text-anchor=\"middle\">{}</text>",
                  after, 0.5 * state_width, escaped(after_title));
  body += panel(section.cells_after, field.values, colours, scale);
  body += lines(section.elements_after, "element-line", scale) +
          lines(section.outline_after, "outline", scale) +
          lines(section.outline_before, "outline before", scale) + "</g>";
  body += colour_bar(colours, bar_label, bar) + length_bar(section, scale);
  return drawing(bar_left + bar.width + bar.room, title_height + scale.height + foot_height, body);
}

std::vector<Figure> section_maps(const std::vector<SolutionSection>& sections, const MapChoice& map,
                                 const std::string& after) {
  std::vector<Figure> row;
  for (const SolutionSection& section : sections) {
    const NamedField* field = find_field(section.fields, map.field);
    if (field == nullptr || section.cells_before.empty()) continue;
    row.push_back(
        {section_map(section, *field, map.bar, after), fmt::format("{}: {}.", section.title, map.words)});
  }
  return row;
}

}  // namespace diastole::report
