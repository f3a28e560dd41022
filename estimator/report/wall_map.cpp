#include "estimator/report/wall_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"

namespace diastole::report {
namespace {

constexpr double map_width = 460, map_height = 190, left = 56, title_height = 24, gap = 34, foot = 26;
constexpr double least_cell_for_text = 34;

/// The values' own range, but never narrower than a hundredth of them: equal values are one colour.
std::array<double, 2> range_of(const std::vector<double>& values) {
  const std::array<double, 2> own = colour_range(values);
  const double middle = 0.5 * (own[0] + own[1]);
  const double least_half = 0.01 * std::abs(middle);
  return {std::min(own[0], middle - least_half), std::max(own[1], middle + least_half)};
}

std::string cell(double x, double y, double width, double height, double value, const ColourScale& scale) {
  if (!std::isfinite(value)) {
    return fmt::format(
        "<path class=\"grid\" style=\"fill:var(--rule)\" d=\"M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z\"/>", x, y,
        width, height, -width);
  }
  const double fraction = scale.fraction_of(value);
  std::string drawn = fmt::format("<path fill=\"{}\" d=\"M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z\"/>",
                                  map_colour(fraction), x, y, width, height, -width);
  if (width < least_cell_for_text) return drawn;
  constexpr double light = 0.6;  // from here on viridis is lighter than white text bears
  return drawn +
         fmt::format("<text style=\"fill:{}\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>",
                     fraction > light ? "#1d2733" : "#ffffff", x + 0.5 * width, y + 0.5 * height + 4,
                     number(value, 3));
}

std::string axis_text(const std::array<size_t, 3>& elements, size_t layer, double top) {
  std::string text;
  for (int degrees = 0; degrees <= 360; degrees += 90) {
    text += fmt::format("<text text-anchor=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{}°</text>",
                        left + map_width * degrees / 360.0, top + map_height + 16, degrees);
  }
  text += fmt::format(
      "<text text-anchor=\"end\" x=\"{0}\" y=\"{1:.1f}\">top</text>"
      "<text text-anchor=\"end\" x=\"{0}\" y=\"{2:.1f}\">bottom</text>",
      left - 5, top + 12, top + map_height);
  if (elements[2] > 1) {
    text += fmt::format("<text class=\"label\" x=\"{}\" y=\"{:.1f}\">layer {} of {}{}</text>", left, top - 9,
                        layer + 1, elements[2], layer == 0 ? ", the inner one" : "");
  }
  return text;
}

}  // namespace

std::string wall_map(const std::array<size_t, 3>& elements, const std::vector<double>& values,
                     const std::string& label) {
  const ColourScale scale{range_of(values)};
  const double width = map_width / static_cast<double>(elements[0]);
  const double height = map_height / static_cast<double>(elements[1]);
  std::string body;
  for (size_t layer = 0; layer < elements[2]; ++layer) {
    const double top = title_height + static_cast<double>(layer) * (map_height + gap);
    for (size_t up = 0; up < elements[1]; ++up) {
      for (size_t around = 0; around < elements[0]; ++around) {
        const double value = values[(layer * elements[1] + up) * elements[0] + around];
        body += cell(left + static_cast<double>(around) * width,
                     top + map_height - static_cast<double>(up + 1) * height, width, height, value, scale);
      }
    }
    body += axis_text(elements, layer, top);
  }
  const ColourBarPlace bar{left + map_width + 18, title_height, map_height};
  body += colour_bar(scale, label, bar);
  const double all = title_height + static_cast<double>(elements[2]) * (map_height + gap) - gap + foot;
  return drawing(bar.left + bar.width + bar.room, all, body);
}

}  // namespace diastole::report
