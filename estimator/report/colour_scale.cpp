#include "estimator/report/colour_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {

std::string map_colour(double fraction) {
  constexpr std::array<std::array<double, 3>, 10> anchors{{{68, 1, 84},
                                                           {72, 40, 120},
                                                           {62, 73, 137},
                                                           {49, 104, 142},
                                                           {38, 130, 142},
                                                           {31, 158, 137},
                                                           {53, 183, 121},
                                                           {110, 206, 88},
                                                           {181, 222, 43},
                                                           {253, 231, 37}}};
  const double place = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(anchors.size() - 1);
  const size_t low = std::min(static_cast<size_t>(place), anchors.size() - 2);
  std::string colour = "#";
  for (size_t i = 0; i < 3; ++i) {
    colour += fmt::format("{:02x}", std::lround(std::lerp(anchors[low][i], anchors[low + 1][i],
                                                          place - static_cast<double>(low))));
  }
  return colour;
}

std::array<double, 2> colour_range(const std::vector<double>& values) {
  std::vector<double> sorted;
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
               [](double v) { return std::isfinite(v); });
  if (sorted.empty()) return {0.0, 1.0};
  std::sort(sorted.begin(), sorted.end());
  const auto last = static_cast<double>(sorted.size() - 1);
  const double low = sorted[static_cast<size_t>(0.02 * last)];
  const double high = sorted[static_cast<size_t>(std::ceil(0.98 * last))];
  const double least = 1e-6 + 1e-6 * std::abs(low);
  return {low, std::max(high, low + least)};
}

std::string colour_bar(const std::array<double, 2>& range, const std::string& label,
                       const ColourBarPlace& place) {
  std::string result;
  const double step = place.height / static_cast<double>(map_colours);
  for (size_t i = 0; i < map_colours; ++i) {
    result += fmt::format("<path stroke=\"{}\" stroke-width=\"{:.2f}\" d=\"M{} {:.2f}h{}\"/>",
                          map_colour((static_cast<double>(i) + 0.5) / static_cast<double>(map_colours)),
                          step + 0.3, place.left,
                          place.top + place.height - (static_cast<double>(i) + 0.5) * step, place.width);
  }
  const std::vector<double> ticks = ticks_over(range[0], range[1], 5);
  const double slack = 1e-9 * (range[1] - range[0]);
  for (const double tick : ticks) {
    if (tick < range[0] - slack || tick > range[1] + slack) continue;
    const double y = place.top + place.height * (range[1] - tick) / (range[1] - range[0]);
    const double shown = std::abs(tick) < 1e-6 * (ticks[1] - ticks[0]) ? 0.0 : tick;
    result +=
        fmt::format("<path class=\"grid\" d=\"M{0} {1:.1f}h4\"/><text x=\"{2}\" y=\"{3:.1f}\">{4}</text>",
                    place.left + place.width, y, place.left + place.width + 7, y + 4, chosen(shown));
  }
  return result + fmt::format("<text class=\"label\" x=\"{}\" y=\"14\" text-anchor=\"end\">{}</text>",
                              place.left + place.width + place.room, escaped(label));
}

}  // namespace diastole::report
