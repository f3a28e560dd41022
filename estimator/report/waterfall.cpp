#include "estimator/report/waterfall.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr double letter_width = 6.8, bar_room = 640, value_room = 70, row_height = 34, bar_height = 20,
                 foot = 46;

std::string name_of(const explain::Step& step, bool first) {
  return first && step.added.empty() ? "base model" : "+ " + step.added;
}

}  // namespace

std::string waterfall(const std::vector<explain::Step>& steps, double floor) {
  double least = floor, most = floor;
  size_t letters = 0;
  for (const explain::Step& step : steps) {
    letters = std::max(letters, name_of(step, &step == &steps.front()).size());
    least = std::min(least, step.reduced_chi_square);
    most = std::max(most, step.reduced_chi_square);
  }
  // Bars begin at half the floor, so that a step at the floor still has one.
  const double left = 14 + letter_width * static_cast<double>(letters);
  const double from = std::max(0.5 * least, 1e-3);
  const double to = std::max(1.15 * most, 4 * from);
  const auto px = [&](double value) {
    return left + bar_room * std::log(std::max(value, from) / from) / std::log(to / from);
  };
  const double bottom = row_height * static_cast<double>(steps.size()) + 8;
  std::string body;
  for (const double tick : decades_over(from, to)) {
    if (tick < from || tick > to) continue;
    body += fmt::format(
        "<path class=\"grid\" d=\"M{0:.1f} 0V{1}\"/><text x=\"{0:.1f}\" y=\"{2}\" "
        "text-anchor=\"middle\">{3}</text>",
        px(tick), bottom, bottom + 17, chosen(tick));
  }
  for (size_t i = 0; i < steps.size(); ++i) {
    const double value = steps[i].reduced_chi_square;
    const double y = row_height * static_cast<double>(i) + 8;
    body += fmt::format("<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", left - 10,
                        y + 15, escaped(name_of(steps[i], i == 0)));
    double end = px(value);
    if (i > 0) {
      const double previous = px(steps[i - 1].reduced_chi_square);
      body += fmt::format("<rect class=\"band {}\" x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\"/>",
                          previous > end ? "c" : "b", std::min(end, previous), y, std::abs(previous - end),
                          bar_height);
      end = std::max(end, previous);
    }
    body += fmt::format(
        "<rect class=\"bars {}\" x=\"{}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\"/>"
        "<text class=\"label\" x=\"{:.1f}\" y=\"{}\">{}</text>",
        i == 0 ? "b" : "a", left, y, px(value) - left, bar_height, end + 8, y + 15, number(value, 3));
  }
  body += fmt::format("<path class=\"mark c\" d=\"M{0:.1f} 0V{1}\"/>", px(floor), bottom);
  body += fmt::format(
      "<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">reduced chi-square on "
      "data that were not fitted; dashed: noise</text>",
      left + bar_room / 2, bottom + 38);
  return drawing(left + bar_room + value_room, bottom + foot, body);
}

}  // namespace diastole::report
