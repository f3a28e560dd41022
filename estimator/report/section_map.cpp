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

constexpr double panel_width = 225, panel_gap = 16, largest_height = 400;
constexpr double title_height = 24, foot_height = 30;
constexpr double bar_left = 2 * panel_width + 2 * panel_gap;

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
      std::min((panel_width - 2 * margin) / (high[0] - low[0]), largest_height / (high[1] - low[1]));
  const double spare_mm = 0.5 * (panel_width / scale - (high[0] - low[0]));
  return {low[0] - spare_mm, high[1] + margin / scale, scale, (high[1] - low[1]) * scale + 2 * margin};
}

/// A path of polygons (closed) or of single lines, in whole tenths of a pixel and relative steps.
class Path {
 public:
  explicit Path(const Scale& scale) : scale_(scale) {}

  void polygon(const FlatPoints& points) {
    for (size_t i = 0; i + 1 < points.size(); i += 2)
      to(i == 0 ? 'M' : 'l', points[i], points[i + 1]);
    text_ += 'z';
  }
  void lines(const FlatPoints& points) {
    for (size_t i = 0; i + 1 < points.size(); i += 2)
      to(i % 4 == 0 ? 'M' : 'l', points[i], points[i + 1]);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void to(char command, double h_mm, double v_mm) {
    const long x = std::lround(10 * scale_.px(h_mm));
    const long y = std::lround(10 * scale_.py(v_mm));
    const bool absolute = command == 'M';
    fmt::format_to(std::back_inserter(text_), "{}{:g} {:g}", command,
                   0.1 * static_cast<double>(absolute ? x : x - x_),
                   0.1 * static_cast<double>(absolute ? y : y - y_));
    x_ = x;
    y_ = y;
  }

  const Scale& scale_;
  std::string text_;
  long x_ = 0, y_ = 0;
};

std::string panel(const std::vector<FlatPoints>& cells, const std::vector<double>& values,
                  const std::array<double, 2>& range, const Scale& scale) {
  std::vector<Path> bins(map_colours, Path(scale));
  for (size_t i = 0; i < cells.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    const double fraction = std::clamp((values[i] - range[0]) / (range[1] - range[0]), 0.0, 1.0);
    bins[std::min(map_colours - 1, static_cast<size_t>(fraction * static_cast<double>(map_colours)))].polygon(
        cells[i]);
  }
  std::string result;
  for (size_t bin = 0; bin < map_colours; ++bin) {
    if (bins[bin].text().empty()) continue;
    // A stroke of the same colour closes the hairlines between neighbours.
    result += fmt::format("<path fill=\"{0}\" stroke=\"{0}\" stroke-width=\".6\" d=\"{1}\"/>",
                          map_colour((static_cast<double>(bin) + 0.5) / static_cast<double>(map_colours)),
                          bins[bin].text());
  }
  return result;
}

std::string lines(const FlatPoints& points, const char* style, const Scale& scale) {
  Path path(scale);
  path.lines(points);
  return fmt::format("<path class=\"{}\" d=\"{}\"/>", style, path.text());
}

/// A bar of a round length under the first drawing.
std::string length_bar(const SolutionSection& section, const Scale& scale) {
  const double length_mm = ticks_over(0, 0.5 * panel_width / scale.px_per_mm, 1)[1];
  const double length = length_mm * scale.px_per_mm;
  const double x = 0.5 * (panel_width - length);
  const double y = title_height + scale.height + 10;
  return fmt::format(
      "<path class=\"ruler\" d=\"M{0:.1f} {1:.1f}v6m0 -3h{2:.1f}m0 -3v6\"/>"
      "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\">{5} mm</text>"
      "<text x=\"{6:.1f}\" y=\"{4:.1f}\" text-anchor=\"middle\">→ {7}, ↑ {8}</text>",
      x, y, length, x + 0.5 * length, y + 18, chosen(length_mm), 1.5 * panel_width + panel_gap,
      escaped(section.horizontal.substr(0, section.horizontal.find(' '))),
      escaped(section.vertical.substr(0, section.vertical.find(' '))));
}

}  // namespace

std::string section_map(const SolutionSection& section, const NamedField& field,
                        const SectionMapLabels& labels) {
  const Scale scale = scale_of(section);
  const std::array<double, 2> range = colour_range(field.values);
  const double after = panel_width + panel_gap;
  const ColourBarPlace bar{bar_left, title_height, scale.height};
  std::string body =
      fmt::format("<text x=\"{}\" y=\"14\" text-anchor=\"middle\">undeformed</text>", 0.5 * panel_width);
  body += panel(section.cells_before, field.values, range, scale);
  body +=
      lines(section.elements_before, "element-line", scale) + lines(section.outline_before, "outline", scale);
  body +=
      fmt::format("<g transform=\"translate({} 0)\"><text x=\"{}\" y=\"14\" text-anchor=\"middle\">{}</text>",
                  after, 0.5 * panel_width, escaped(labels.after));
  body += panel(section.cells_after, field.values, range, scale);
  body += lines(section.elements_after, "element-line", scale) +
          lines(section.outline_after, "outline", scale) +
          lines(section.outline_before, "outline before", scale) + "</g>";
  body += colour_bar(range, labels.bar, bar) + length_bar(section, scale);
  return fmt::format(
      "<svg class=\"plot\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" role=\"img\">{2}</svg>",
      bar_left + bar.width + bar.room, title_height + scale.height + foot_height, body);
}

}  // namespace diastole::report
