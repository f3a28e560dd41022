#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/svg_plot.hpp"
#include "tools/diastole/compare/comparison.hpp"

namespace diastole::comparison {
namespace {

using report::number;
using report::SvgPlot;

const char* style_of(size_t run) {
  static constexpr std::array styles{"a", "b", "c", "muted"};
  return styles[std::min(run, styles.size() - 1)];
}

std::string name_of(const std::string& file) { return std::filesystem::path(file).filename().string(); }

std::vector<double> shifted(const std::vector<double>& values, const std::vector<double>& by, double factor) {
  std::vector<double> out;
  for (size_t i = 0; i < values.size(); ++i)
    out.push_back(values[i] + factor * by[i]);
  return out;
}

report::Figure mean_cycles(const Comparison& comparison, const Overlay& overlay) {
  SvgPlot plot({.x = {.label = "phase of the cycle"}, .y = {.label = overlay.channel}});
  for (const MeanCycle& cycle : overlay.cycles) {
    plot.band(overlay.phase, shifted(cycle.mean_kPa, cycle.sd_kPa, -1),
              shifted(cycle.mean_kPa, cycle.sd_kPa, 1), style_of(cycle.run));
    plot.line(overlay.phase, cycle.mean_kPa, style_of(cycle.run), name_of(comparison.files[cycle.run]));
  }
  return {
      plot.svg(),
      fmt::format("Segment {}, {}: mean over the cycles; the bands are one standard deviation of a cycle.",
                  overlay.segment, overlay.channel)};
}

report::Figure differences(const Comparison& comparison, const Overlay& overlay) {
  SvgPlot plot({.x = {.label = "phase of the cycle"}, .y = {.label = "difference to the first run (Pa)"}});
  const MeanCycle& first = overlay.cycles.front();
  for (const Departure& departure : overlay.departures) {
    const auto cycle = std::ranges::find(overlay.cycles, departure.run, &MeanCycle::run);
    std::vector<double> difference_Pa, low_Pa, high_Pa;
    for (size_t i = 0; i < overlay.phase.size(); ++i) {
      difference_Pa.push_back(1e3 * (cycle->mean_kPa[i] - first.mean_kPa[i]));
      high_Pa.push_back(1e3 * departure.limit_in_errors *
                        std::hypot(cycle->error_kPa[i], first.error_kPa[i]));
      low_Pa.push_back(-high_Pa.back());
    }
    plot.band(overlay.phase, low_Pa, high_Pa, style_of(departure.run));
    plot.line(overlay.phase, difference_Pa, style_of(departure.run),
              name_of(comparison.files[departure.run]));
  }
  return {plot.svg(),
          "A line that leaves its band around zero differs from the first run by more than noise."};
}

void add_outcome(report::Page& page, const Comparison& comparison) {
  const size_t undecided = comparison.count(Outcome::undecided);
  const auto outcome = comparison.outcome();
  if (!outcome) {
    page.headline("traces", "not tested", "no motion that two runs share with noise that is known");
  } else if (outcome == Outcome::differs) {
    page.headline("traces", "differ", "by more than noise");
  } else if (outcome == Outcome::undecided) {
    page.headline("traces", "may agree or differ", "noise is not known or large beside the trace");
  } else {
    page.headline("traces", "agree",
                  undecided == 0
                      ? "within their noise"
                      : fmt::format("within their noise; in {} of {} traces it is not known or large",
                                    undecided, undecided + comparison.count(Outcome::agrees)));
  }
}

}  // namespace

std::string comparison_page(const Comparison& comparison) {
  report::Page page("Runs compared");
  add_outcome(page, comparison);
  page.headline("runs", fmt::format("{}", comparison.files.size()), "each against the first");
  page.headline("settings and facts", fmt::format("{}", comparison.differences.size()),
                "that are not the same in all");
  page.section("What tells them apart",
               "Session, protocol, rig and calibration, where they are not the same in all runs.");
  for (const std::string& remark : comparison.remarks)
    page.warning(remark);
  report::Page::Row header{"", ""};
  for (const std::string& file : comparison.files)
    header.push_back(name_of(file));
  page.table_of(
      comparison.differences, header,
      [](const Difference& difference) {
        report::Page::Row row{difference.group, difference.place};
        row.insert(row.end(), difference.values.begin(), difference.values.end());
        return row;
      },
      comparison.differences.empty() ? "Nothing: all are the same." : "Empty: this run does not say.", 1);
  page.section("Pressure over the cycle", "Cycles averaged from trigger to trigger, with their scatter.");
  for (const Overlay& overlay : comparison.overlays) {
    if (overlay.cycles.empty()) continue;
    std::vector<report::Figure> row{mean_cycles(comparison, overlay)};
    if (!overlay.departures.empty()) row.push_back(differences(comparison, overlay));
    page.figures(row);
    page.table_of(
        overlay.departures,
        {"against the first run", "offset (Pa)", "gain", "rms (Pa)", "worst (Pa)", "at phase", "in errors",
         "limit", "noise allows (Pa)", ""},
        [&](const Departure& departure) {
          return report::Page::Row{name_of(comparison.files[departure.run]),
                                   number(departure.offset_Pa, 3),
                                   number(departure.gain, 5),
                                   number(departure.rms_Pa, 3),
                                   number(departure.worst_Pa, 3),
                                   number(departure.worst_phase, 2),
                                   number(departure.worst_in_errors, 3),
                                   number(departure.limit_in_errors, 3),
                                   number(departure.allowed_Pa, 3),
                                   departure.outcome() == Outcome::differs  ? "differs"
                                   : departure.outcome() == Outcome::agrees ? "agrees"
                                                                            : "may agree or differ"};
        },
        "The limit is Student's t for the cycles at hand; equal runs pass it once in a hundred comparisons. "
        "Where noise allows more than a tenth of the trace's range, runs may differ without its being seen.");
  }
  return page.html();
}

}  // namespace diastole::comparison
