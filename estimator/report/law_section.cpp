#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "estimator/law_fit/law_comparison.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr std::array<const char*, 3> curve_styles{"a", "b", "c"};

std::string test_name(const BenchTest& test) { return std::filesystem::path(test.file).filename().string(); }

std::string percent_text(double value) { return std::isfinite(value) ? number(value, 2) : "no answer"; }

/// The laws whose curves are drawn: the preferred one first, then by their score.
std::vector<const ComparedLaw*> drawn_laws(const LawComparison& comparison) {
  std::vector<const ComparedLaw*> drawn;
  if (comparison.preferred) drawn.push_back(&comparison.laws[*comparison.preferred]);
  for (const ComparedLaw& law : comparison.laws) {
    const bool is_known = std::ranges::find(drawn, &law) != drawn.end();
    if (!is_known && !law.fit.channels.empty() && drawn.size() < curve_styles.size()) drawn.push_back(&law);
  }
  return drawn;
}

/// A jump back over half of the axis begins another curve: a hole in the line.
void draw_curve(SvgPlot& plot, const std::vector<double>& x, const std::vector<double>& y,
                const ComparedLaw& law, const char* style) {
  const auto [least, most] = std::ranges::minmax(x);
  std::vector<double> line_x, line_y;
  for (size_t i = 0; i < x.size(); ++i) {
    if (i > 0 && std::abs(x[i] - x[i - 1]) > (most - least) / 2) {
      line_x.push_back(x[i]);
      line_y.push_back(std::numeric_limits<double>::quiet_NaN());
    }
    line_x.push_back(x[i]);
    line_y.push_back(y[i]);
  }
  plot.line(line_x, line_y, style, std::string(law.fit.law->name()));
}

/// "nominal_kPa" as "nominal (kPa)".
std::string axis_words(std::string_view column) {
  std::string words(column);
  for (const std::string unit : {"kPa", "mm", "deg", "Nmm", "N"}) {
    if (!words.ends_with("_" + unit)) continue;
    words.resize(words.size() - unit.size() - 1);
    words += fmt::format(" ({})", unit == "Nmm" ? "N mm" : unit == "deg" ? "degrees" : unit);
    break;
  }
  std::ranges::replace(words, '_', ' ');
  return words;
}

Figure channel_figure(const BenchTest& test, size_t test_index, size_t channel,
                      const std::vector<const ComparedLaw*>& laws) {
  SvgPlot plot({.x = {.label = axis_words(test.kind->columns[test.kind->abscissa])},
                .y = {.label = axis_words(test.channels[channel].name)}});
  const auto x = numbers_of(test.readings,
                            [&](const Reading& reading) { return reading.controls[test.kind->abscissa]; });
  const auto y = numbers_of(test.readings, [&](const Reading& reading) { return reading.measured[channel]; });
  plot.points(x, y, "muted", "measured");
  std::vector<std::string> words;
  for (size_t i = 0; i < laws.size(); ++i) {
    for (const ChannelFit& fitted : laws[i]->fit.channels) {
      if (fitted.test != test_index || fitted.channel != channel) continue;
      draw_curve(plot, x, fitted.predicted, *laws[i], curve_styles[i]);
      words.push_back(fmt::format("{} {}", laws[i]->fit.law->name(), number(fitted.rms, 2)));
    }
  }
  return {plot.svg(), fmt::format("{}: {}. RMS of what the laws leave: {}.", test_name(test),
                                  axis_words(test.channels[channel].name), fmt::join(words, ", "))};
}

void add_law_comparison(Page& page, const LawComparison& comparison) {
  page.section("Laws compared",
               comparison.over_kinds
                   ? "Each kind of test is left out in turn: the law is fitted to the others and predicts it."
                   : "There is one kind of test: every fifth reading is left out in turn and predicted by "
                     "the others. That "
                     "says little about other kinds.");
  page.paragraph(comparison.why);
  Page::Row header{"law", "parameters", "fit (%)", "prediction (%)"};
  for (const std::string& fold : comparison.folds)
    if (comparison.over_kinds) header.push_back("without " + fold);
  header.emplace_back("as good as the best");
  const size_t words_from = header.size() - 1;
  const auto row_of = [&](const ComparedLaw& law) {
    Page::Row row{std::string(law.fit.law->name()), std::to_string(law.fit.law->parameters().size()),
                  law.fit.parameters.empty() ? "no answer" : number(law.fit.error_percent, 2),
                  percent_text(law.predicted_percent)};
    for (const LeftOut& left_out : law.left_out) {
      if (comparison.over_kinds)
        row.push_back(percent_text(left_out.error_percent) + (left_out.determined ? "" : " *"));
    }
    row.emplace_back(law.distinguished ? "no" : "yes");
    return row;
  };
  page.table_of(comparison.laws, header, row_of,
                "RMS of prediction less measurement, in % of each column's RMS. *: the tests that were left "
                "do not determine "
                "the law.",
                words_from);
}

std::string open_words(const Undetermined& undetermined) {
  std::vector<std::string> parts;
  for (const auto& [name, change] : undetermined.change_percent)
    parts.push_back(fmt::format("{} by {:+.2g} %", name, change));
  return fmt::format("Not determined: {} together{}.", fmt::join(parts, ", "),
                     std::isfinite(undetermined.sd_percent)
                         ? fmt::format(", known to {:.0f} times that only", undetermined.sd_percent)
                         : ", which changes nothing that was measured");
}

void add_law_parameters(Page& page, const ComparedLaw& law) {
  page.section(fmt::format("Parameters of {}", law.fit.law->name()), law.fit.reason);
  for (const Undetermined& undetermined : law.fit.undetermined)
    page.warning(open_words(undetermined));
  for (const std::string& remark : law.fit.remarks)
    page.warning(remark);
  const auto row_of = [](const LawParameterEstimate& parameter) -> Page::Row {
    const bool known = std::isfinite(parameter.se);
    const bool bound = parameter.bound != inference::BoundSide::none;
    return {parameter.name,
            known && !bound ? with_error(parameter.value, parameter.se) : number(parameter.value),
            bound   ? "on its bound"
            : known ? fmt::format("{} to {}", number(parameter.ci95[0]), number(parameter.ci95[1]))
                    : "not determined"};
  };
  page.table_of(law.fit.parameters, {"parameter", "value", "95 % interval"}, row_of,
                "Student's t; every column's errors as the same part of its RMS.");
}

}  // namespace

void add_laws(Page& page, const std::vector<BenchTest>& tests, const LawComparison& comparison) {
  const std::vector<const ComparedLaw*> drawn = drawn_laws(comparison);
  if (comparison.preferred) {
    const LawFit& fit = comparison.laws[*comparison.preferred].fit;
    const LawParameterEstimate& first = fit.parameters.front();
    page.headline("Law", std::string(fit.law->name()),
                  fmt::format("predicts within {} % what it was not fitted to",
                              percent_text(comparison.laws[*comparison.preferred].predicted_percent)));
    page.headline(first.name, std::isfinite(first.se) ? with_error(first.value, first.se) : "not determined",
                  std::string(fit.law->parameters().front().meaning));
  }
  add_law_comparison(page, comparison);
  for (const ComparedLaw* law : drawn)
    add_law_parameters(page, *law);
  for (size_t t = 0; t < tests.size(); ++t) {
    page.section(std::string(tests[t].kind->title),
                 fmt::format("{}: {} readings.", test_name(tests[t]), tests[t].readings.size()));
    std::vector<Figure> figures;
    for (size_t channel = 0; channel < tests[t].channels.size(); ++channel)
      figures.push_back(channel_figure(tests[t], t, channel, drawn));
    page.figures(figures);
  }
}

}  // namespace diastole::report
