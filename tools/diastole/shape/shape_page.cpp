#include <fmt/format.h>

#include <filesystem>

#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/svg_plot.hpp"
#include "tools/diastole/shape/shaper.hpp"

namespace diastole::shaping {
namespace {

using report::number;
using report::SvgPlot;

constexpr size_t plotted = 256;

std::vector<double> closed(std::vector<double> values) {
  values.push_back(values.front());
  return values;
}

std::vector<double> times_of(const PeriodicCurve& curve) {
  std::vector<double> time_s;
  for (size_t j = 0; j <= plotted; ++j)
    time_s.push_back(curve.period_s * static_cast<double>(j) / plotted);
  return time_s;
}

report::Figure volumes(const PeriodicCurve& wanted, const PeriodicCurve& seen, const PeriodicCurve& drive,
                       const std::string& name) {
  SvgPlot plot({.x = {.label = "time on the wanted curve (s)"}, .y = {.label = "volume (mL)"}});
  const std::vector<double> time_s = times_of(wanted);
  plot.line(time_s, closed(drive.at_even(plotted)), "muted", "drive");
  plot.line(time_s, closed(wanted.at_even(plotted)), "a", "wanted");
  plot.line(time_s, closed(seen.at_even(plotted)), "b", name);
  return {plot.svg(), "What the piston was asked for, what was wanted of the specimen, and what it did."};
}

report::Figure error_of(const PeriodicCurve& wanted, PeriodicCurve seen, double floor) {
  SvgPlot plot({.x = {.label = "time on the wanted curve (s)"}, .y = {.label = "error (% of the range)"}});
  const std::vector<double> time_s = times_of(wanted);
  seen.c[0] = wanted.c[0];
  std::vector<double> error = closed(seen.at_even(plotted));
  const std::vector<double> aim = closed(wanted.at_even(plotted));
  for (size_t j = 0; j < error.size(); ++j)
    error[j] = 100.0 * (error[j] - aim[j]) / wanted.range();
  const std::vector<double> low(error.size(), -100.0 * floor), high(error.size(), 100.0 * floor);
  plot.band(time_s, low, high, "a", "noise");
  plot.line(time_s, error, "b", "error");
  return {plot.svg(), "Volume less the wanted one, both about their means; the band is one noise."};
}

report::Figure contraction(const Lesson& lesson) {
  SvgPlot plot(
      {.x = {.label = "frequency (Hz)"}, .y = {.label = "error of a run over that before", .from = 0.0}});
  std::vector<double> frequency_Hz, expected, found_Hz, found;
  for (const LearnedHarmonic& one : lesson.harmonics) {
    if (one.frequency_Hz == 0.0) continue;
    frequency_Hz.push_back(one.frequency_Hz);
    expected.push_back(one.contraction_expected);
    if (!one.contraction_found) continue;
    found_Hz.push_back(one.frequency_Hz);
    found.push_back(*one.contraction_found);
  }
  plot.line(frequency_Hz, expected, "a", "expected of the next");
  if (!found.empty()) plot.points(found_Hz, found, "b", "found in the last");
  return {plot.svg(), "Below 1 the error of that frequency shrinks from run to run."};
}

}  // namespace

std::string shaping_page(const Shaping& shaping, const PeriodicCurve& wanted_mL, const std::string& target) {
  const Lesson& lesson = shaping.lesson;
  report::Page page(fmt::format("The specimen follows {}", target));
  page.headline("NRMSE", fmt::format("{:.2f} %", 100.0 * shaping.seen.nrmse),
                lesson.best ? "of the best run, about the mean" : "as the model expects, before any run");
  page.headline("level", fmt::format("{:+.2f} mL", shaping.seen.level_mL), "mean volume less the wanted one");
  page.headline("runs", fmt::format("{}", lesson.iterations.size()), in_words(lesson.ending));
  page.headline("held back by", shaping.binding_limit.empty() ? "nothing" : shaping.binding_limit,
                "of the pump's limits");
  page.section("The drive", "The next one; when learning has ended, the best run's.");
  if (lesson.ending == Ending::changed) page.warning(lesson.reason);
  page.figures({volumes(wanted_mL, lesson.expected_mL, lesson.drive_mL, "expected")});
  page.table_of(
      shaping.cycle.limits, {"limit", "asked", "allowed", "unit"},
      [](const LimitUse& use) {
        return report::Page::Row{use.limit, number(use.asked), number(use.allowed), use.unit};
      },
      "As the controller checks them before anything moves; cavity: what the specimen is expected to hold.",
      3);
  for (size_t i = 0; i < lesson.iterations.size(); ++i) {
    const Iteration& it = lesson.iterations[i];
    page.section(fmt::format("Run {}: NRMSE {:.2f} %", i + 1, 100.0 * it.nrmse),
                 fmt::format("{}, by {}; noise {:.2f} %, level {:+.2f} mL.",
                             std::filesystem::path(it.run).filename().string(), it.source, 100.0 * it.floor,
                             it.level_error_mL));
    page.figures({volumes(wanted_mL, it.cavity_mL, it.drive_mL, "measured"),
                  error_of(wanted_mL, it.cavity_mL, it.floor)});
  }
  if (lesson.iterations.empty()) return page.html();
  page.section(
      "What was learned",
      "The model's effects as the runs have corrected them, and what each frequency is still off by.");
  page.figures({contraction(lesson)});
  page.table_of(
      lesson.model, {"effect", "parameter", "value"},
      [](const LearnedValue& one) {
        return report::Page::Row{one.effect, one.parameter, number(one.value)};
      },
      "No verdict: effects that look alike share what they explain (diastole explain).");
  return page.html();
}

}  // namespace diastole::shaping
