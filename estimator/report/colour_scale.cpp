#include "estimator/report/colour_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

using Colour = std::array<double, 3>;

std::string mixed(const Colour& from, const Colour& to, double part) {
  std::string colour = "#";
  for (size_t i = 0; i < 3; ++i)
    colour += fmt::format("{:02x}", std::lround(std::lerp(from[i], to[i], part)));
  return colour;
}

}  // namespace

std::string map_colour(double fraction) {
  constexpr std::array<Colour, 10> anchors{{{68, 1, 84},
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
  return mixed(anchors[low], anchors[low + 1], place - static_cast<double>(low));
}

std::string signed_colour(double fraction) {
  constexpr Colour blue{33, 102, 172}, white{247, 247, 247}, red{178, 24, 43};
  return mixed(white, fraction < 0.5 ? blue : red, std::abs(2 * fraction - 1));
}

double ColourScale::fraction_of(double value) const {
  return std::clamp((value - range[0]) / (range[1] - range[0]), 0.0, 1.0);
}

std::string ColourScale::colour_of_step(size_t step) const {
  return colour((static_cast<double>(step) + 0.5) / static_cast<double>(steps));
}

void CellPainter::add(double value, std::string_view outline) {
  if (!std::isfinite(value)) return;
  const auto step = static_cast<size_t>(scale_.fraction_of(value) * static_cast<double>(scale_.steps));
  paths_[std::min(scale_.steps - 1, step)] += outline;
}

std::string CellPainter::svg(double stroke) const {
  std::string result;
  for (size_t step = 0; step < paths_.size(); ++step) {
    if (paths_[step].empty()) continue;
    result += fmt::format("<path fill=\"{0}\" stroke=\"{0}\" stroke-width=\"{1}\" d=\"{2}\"/>",
                          scale_.colour_of_step(step), stroke, paths_[step]);
  }
  return result;
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

std::string colour_bar(const ColourScale& scale, const std::string& label, const ColourBarPlace& place) {
  const std::array<double, 2>& range = scale.range;
  std::string result;
  const double height = place.height / static_cast<double>(scale.steps);
  for (size_t step = 0; step < scale.steps; ++step) {
    result += fmt::format("<path stroke=\"{}\" stroke-width=\"{:.2f}\" d=\"M{} {:.2f}h{}\"/>",
                          scale.colour_of_step(step), height + 0.3, place.left,
                          place.top + place.height - (static_cast<double>(step) + 0.5) * height, place.width);
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
