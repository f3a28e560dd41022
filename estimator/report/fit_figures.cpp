#include "estimator/report/fit_figures.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"
#include "estimator/report/wall_map.hpp"

namespace diastole::report {
namespace {

constexpr double rise_at_95 = 1.92;  // half of chi-square's 95 % point, one degree of freedom

Figure values_by_number(const FittedParameter& parameter) {
  SvgPlot plot({.x = {.label = "element"}, .y = {.label = parameter.name}});
  std::vector<double> index(parameter.elements.size());
  std::iota(index.begin(), index.end(), 0.0);
  const auto value = numbers_of(parameter.elements, &FittedElement::value);
  const auto error = numbers_of(parameter.elements, [](const auto& element) { return 1.96 * element.se; });
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
