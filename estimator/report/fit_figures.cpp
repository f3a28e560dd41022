#include "estimator/report/fit_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "estimator/inference/intervals.hpp"
#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

// The values of a wall's elements on the wall unrolled: cut along the first element's left side and laid flat.
//
//     top    +-----+-----+ - - +-----+   one drawing a layer through the wall, the inner one first;
//            | 8.6 | 8.7 |     | 8.5 |   across: the angle around the axis, 0 to 360°
//     bottom +-----+-----+ - - +-----+

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

/// `values` in the order of the elements: around, then along, then through the wall; `elements` counts them so. One that
/// is no number is left grey. `label` stands above the colour bar.
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

constexpr double rise_at_95 = 1.92;  // half of chi-square's 95 % point, one degree of freedom

Figure values_by_number(const FittedParameter& parameter) {
  SvgPlot plot({.x = {.label = "element"}, .y = {.label = parameter.name}});
  std::vector<double> index(parameter.elements.size());
  std::iota(index.begin(), index.end(), 0.0);
  const auto value = numbers_of(parameter.elements, &FittedElement::value);
  const auto error =
      numbers_of(parameter.elements, [](const auto& element) { return inference::normal_95 * element.se; });
  plot.error_bars(index, value, error, "a");
  plot.points(index, value, "a", "value and 95 % interval of each element");
  return {plot.svg(), "Regional values, one an element."};
}

/// The profile between the points where it was tried: its signed root is nearly straight.
double rise_at(const FittedProfile& profile, double best, double at) {
  const auto root = [&](size_t i) {
    return std::copysign(std::sqrt(profile.cost_rise[i]), profile.value[i] - best);
  };
  size_t i = 1;
  while (i + 1 < profile.value.size() && profile.value[i] < at)
    ++i;
  const double width = profile.value[i] - profile.value[i - 1];
  const double part = width > 0 ? (at - profile.value[i - 1]) / width : 0.0;
  return std::pow(std::lerp(root(i - 1), root(i), part), 2);
}

}  // namespace

std::vector<Figure> regional_figures(const FitRecord& fit, const FittedParameter& parameter) {
  const bool rings = fit.mesh.size() == 3 && static_cast<size_t>(fit.mesh[0]) *
                                                     static_cast<size_t>(fit.mesh[1]) *
                                                     static_cast<size_t>(fit.mesh[2]) ==
                                                 parameter.elements.size();
  if (!rings) return {values_by_number(parameter)};
  const std::array<size_t, 3> elements{static_cast<size_t>(fit.mesh[0]), static_cast<size_t>(fit.mesh[1]),
                                       static_cast<size_t>(fit.mesh[2])};
  const auto error_percent =
      numbers_of(parameter.elements, [](const auto& element) { return 100 * element.se / element.value; });
  return {{wall_map(elements, numbers_of(parameter.elements, &FittedElement::value), parameter.name),
           fmt::format("{} of each element on the wall unrolled.", parameter.name)},
          {wall_map(elements, error_percent, "error (%)"),
           "Their standard errors. Neighbours that are held alike share what they know."}};
}

Figure profile_figure(const FittedParameter& parameter) {
  const FittedProfile& profile = *parameter.profile;
  SvgPlot plot({.x = {.label = parameter.name}, .y = {.label = "rise of −log likelihood", .from = 0.0}});
  std::vector<double> x, parabola, curve;
  const double low = profile.value.front(), high = profile.value.back();
  const bool factor = low > 0;  // the symmetric interval of a positive value is one of its logarithm
  constexpr int samples = 81;
  for (int i = 0; i < samples; ++i) {
    const double at = low + (high - low) * i / (samples - 1);
    const double away = factor ? std::log(at / parameter.value) * parameter.value : at - parameter.value;
    x.push_back(at);
    parabola.push_back(0.5 * std::pow(away / parameter.se, 2));
    curve.push_back(rise_at(profile, parameter.value, at));
  }
  plot.line(x, parabola, "muted dashed", "what the standard error says");
  plot.line(x, curve, "a", "the likelihood's profile");
  plot.points(profile.value, profile.cost_rise, "a");
  const std::vector<double> ends{low, high}, limit{rise_at_95, rise_at_95};
  plot.line(ends, limit, "b thin", "95 %");
  return {plot.svg(),
          fmt::format("{}: the cost with it held there and all others at their best. {} to {} with 95 %.",
                      parameter.name, number(profile.ci95[0], 4), number(profile.ci95[1], 4))};
}

}  // namespace diastole::report
