#include "tools/diastole/runs/runs_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"

namespace diastole::catalogue {
namespace {

using report::escaped;

constexpr std::string_view style =
    ".runs td { text-align: left; vertical-align: middle; } .runs td.path { white-space: normal; "
    "overflow-wrap: anywhere; }\n"
    ".runs svg { width: 168px; height: 40px; display: block; } .runs .no { color: var(--b); }\n";

/// Up one side of the envelope and back the other: what lies between least and largest.
std::string thumbnail(const std::vector<float>& trace) {
  constexpr double width = 168, height = 40, margin = 2;
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (const float recorded_kPa : trace) {
    if (std::isnan(recorded_kPa)) continue;
    const auto value_kPa = static_cast<double>(recorded_kPa);
    least = std::min(least, value_kPa);
    most = std::max(most, value_kPa);
  }
  if (!(least <= most)) return {};
  const size_t parts = trace.size() / 2;
  const double span = std::max(most - least, 1e-9);
  std::string up, back;
  for (size_t i = 0; i < parts; ++i) {
    if (std::isnan(trace[2 * i])) continue;
    const double x =
        margin + (width - 2 * margin) * (static_cast<double>(i) + 0.5) / static_cast<double>(parts);
    const auto y = [&](float value_kPa) {
      return height - margin - (height - 2 * margin) * (static_cast<double>(value_kPa) - least) / span;
    };
    up += fmt::format("{}{:.1f} {:.1f}", up.empty() ? "M" : "L", x, y(trace[2 * i + 1]));
    back = fmt::format("L{:.1f} {:.1f}", x, y(trace[2 * i])) + back;
  }
  return fmt::format(
      "<svg viewBox=\"0 0 {} {}\" class=\"a\"><title>{:.2f} to {:.2f} kPa</title><path d=\"{}{}Z\" "
      "fill=\"var(--series)\" stroke=\"var(--series)\" stroke-width=\"0.8\"/></svg>",
      width, height, least, most, up, back);
}

std::string row_of(const Entry& entry) {
  std::string row = fmt::format("<tr><td>{}</td>", thumbnail(entry.trace));
  for (const std::string& cell :
       {entry.date, entry.kind, entry.specimen, entry.operator_name, entry.protocol})
    row += fmt::format("<td>{}</td>", escaped(cell));
  row += entry.sound == false
             ? fmt::format("<td class=\"no\" title=\"{}\">not sound</td>", escaped(entry.problem))
             : fmt::format("<td>{}</td>", sound_words(entry));
  row += fmt::format("<td>{}{}</td>", escaped(entry.verdict),
                     entry.effects.empty() ? "" : ": " + escaped(entry.effects));
  return row + fmt::format("<td>{}</td><td class=\"path\">{}</td></tr>\n", escaped(stiffness_words(entry)),
                           escaped(entry.path));
}

}  // namespace

std::string stiffness_words(const Entry& entry) {
  if (!entry.stiffness_kPa) return {};
  return (entry.stiffness_se_kPa ? report::with_error(*entry.stiffness_kPa, *entry.stiffness_se_kPa)
                                 : report::number(*entry.stiffness_kPa)) +
         " kPa";
}

std::string sound_words(const Entry& entry) {
  return !entry.sound ? "" : *entry.sound ? "sound" : "not sound";
}

std::string runs_page(const std::string& folder, const std::string& asked, const Found& found) {
  report::Page page("Runs in " + folder);
  std::set<std::string> specimens;
  int64_t unsound = 0;
  for (const Entry& entry : found.entries) {
    if (!entry.specimen.empty()) specimens.insert(entry.specimen);
    unsound += entry.sound == false ? 1 : 0;
  }
  page.headline("found", fmt::format("{}", found.matched), asked.empty() ? "everything there is" : asked);
  page.headline("specimens", fmt::format("{}", specimens.size()), "among those shown");
  page.headline("not sound", fmt::format("{}", unsound), "the reason stands under the pointer");
  page.section(
      "Runs, fits, explanations and images",
      fmt::format(
          "{} of {} are shown. A thumbnail is the cavity's pressure over the run, between its least and "
          "largest value.",
          found.entries.size(), found.matched));
  std::string table =
      "<table class=\"runs\"><thead><tr><td></td><td>date</td><td>kind</td><td>specimen</td><td>operator</td>"
      "<td>protocol</td><td>soundness</td><td>verdict</td><td>stiffness</td><td>file</td></tr></thead>\n";
  for (const Entry& entry : found.entries)
    table += row_of(entry);
  page.part(table + "</table>\n", style, "", "runs", "null");
  return page.html();
}

}  // namespace diastole::catalogue
