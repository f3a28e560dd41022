#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "estimator/montecarlo/montecarlo.hpp"
#include "estimator/report/fit_figures.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

/// The first entry that knows its parameters; nullptr if none has two refits yet.
const TableEntry* first_known(const SavedTable& table) {
  for (const TableEntry& entry : table.entries) {
    if (!entry.parameters.empty()) return &entry;
  }
  return nullptr;
}

std::string percents(const TableEntry& entry, double (*of)(const ParameterSpread&)) {
  std::vector<std::string> words;
  for (const ParameterSpread& spread : entry.parameters)
    words.push_back(fmt::format("{:.1f}", of(spread)));
  return fmt::format("{}", fmt::join(words, " / "));
}

std::string papers(const TableEntry& entry) {
  const auto cells = paper_sd_percent(entry.noise_mm, entry.frames);
  return cells ? fmt::format("{:g}", fmt::join(*cells, " / ")) : "–";
}

/// The geometric mean over the noises of what `percent` gives for an entry, a millimetre of noise. Standard deviations are
/// proportional to the noise where they are small, so that this pools all cells of one number of frames.
std::string pooled(const SavedTable& table, int frames,
                   const std::function<std::optional<std::array<double, 4>>(const TableEntry&)>& percent) {
  std::array<double, 4> logarithms{};
  double count = 0;
  for (const TableEntry& entry : table.entries) {
    if (entry.frames != frames || !(entry.noise_mm > 0) || entry.parameters.empty()) continue;
    const auto cells = percent(entry);
    if (!cells) continue;
    for (size_t i = 0; i < cells->size(); ++i)
      logarithms[i] += std::log((*cells)[i] / entry.noise_mm);
    ++count;
  }
  if (count == 0) return "–";
  for (double& value : logarithms)
    value = std::exp(value / count);
  return fmt::format("{:.1f}", fmt::join(logarithms, " / "));
}

/// All noises together beside the paper's, a row for each number of frames.
void add_pooled(Page& page, const SavedTable& table, const std::set<int>& frames) {
  const auto of = [](double (*percent)(const ParameterSpread&)) {
    return [percent](const TableEntry& entry) -> std::optional<std::array<double, 4>> {
      std::array<double, 4> values{};
      for (size_t i = 0; i < values.size(); ++i)
        values[i] = percent(entry.parameters[i]);
      return values;
    };
  };
  std::vector<std::vector<std::string>> rows;
  for (const int count : frames) {
    rows.push_back(
        {std::to_string(count),
         pooled(table, count, of([](const ParameterSpread& spread) { return spread.sd_percent; })),
         pooled(table, count, of([](const ParameterSpread& s) { return 100 * s.mean_se / s.mean; })),
         pooled(table, count,
                [](const TableEntry& entry) { return paper_sd_percent(entry.noise_mm, entry.frames); })});
  }
  page.table({"frames", "standard deviation (% a mm)", "their own error (% a mm)", "paper (% a mm)"}, rows,
             "The same for all noises together: geometric means of the spread divided by the noise.");
}

/// Whether the paper's Table 1 is of these parameters.
bool is_papers_law(const SavedTable& table) {
  constexpr std::array<const char*, 4> names{"C_kPa", "b1", "b2", "b3"};
  const TableEntry* known = first_known(table);
  return known != nullptr &&
         std::equal(known->parameters.begin(), known->parameters.end(), names.begin(), names.end(),
                    [](const ParameterSpread& spread, const char* name) { return spread.name == name; });
}

}  // namespace

Figure table_figure(const SavedTable& table, size_t parameter) {
  constexpr std::array<const char*, 3> styles{"b", "a", "c"};
  SvgPlot plot(
      {.x = {.label = "noise (mm)", .from = 0.0}, .y = {.label = "standard deviation (%)", .from = 0.0}});
  std::set<int> frames;
  for (const TableEntry& entry : table.entries)
    frames.insert(entry.frames);
  size_t style = 0;
  const bool compared = is_papers_law(table);
  for (const int count : frames) {
    std::vector<double> noise_mm, sd, paper_mm, paper;
    for (const TableEntry& entry : table.entries) {
      if (entry.frames != count || entry.parameters.empty()) continue;
      noise_mm.push_back(entry.noise_mm);
      sd.push_back(entry.parameters[parameter].sd_percent);
      const auto cells = compared ? paper_sd_percent(entry.noise_mm, count) : std::nullopt;
      if (!cells) continue;
      paper_mm.push_back(entry.noise_mm);
      paper.push_back((*cells)[parameter]);
    }
    const char* line_style = styles[style++ % styles.size()];
    plot.line(noise_mm, sd, line_style, fmt::format("{} frame{}", count, count == 1 ? "" : "s"));
    if (!paper.empty()) plot.points(paper_mm, paper, line_style);
  }
  return {plot.svg(), fmt::format("{}: standard deviation of the refits in % of their mean.{}",
                                  first_known(table)->parameters[parameter].name,
                                  compared ? " Dots are the paper's." : "")};
}

void add_montecarlo(Page& page, const SavedTable& table) {
  page.section(
      "How precisely the study tells its parameters",
      fmt::format("Study {}: synthetic data with known values, refitted. Frame pressures are {}.",
                  table.study, table.exact_pressures ? "exactly known" : "as uncertain as the study says"));
  const TableEntry* known = first_known(table);
  if (known == nullptr) {
    page.warning("No noise and number of frames has two refits yet: there is no spread to tell.");
    return;
  }
  const bool compared = is_papers_law(table);
  std::vector<std::string> names;
  for (const ParameterSpread& spread : known->parameters)
    names.push_back(fmt::format("{} = {:.4g}", spread.name, spread.truth));
  std::vector<std::vector<std::string>> rows;
  for (const TableEntry& entry : table.entries) {
    const std::string noise = entry.noise_mm > 0 ? fmt::format("{:g} mm", entry.noise_mm) : "as stated";
    std::vector<std::string> row{
        noise, std::to_string(entry.frames),
        fmt::format("{}{}", entry.refits, entry.failed > 0 ? fmt::format(" ({} failed)", entry.failed) : "")};
    row.push_back(percents(entry, [](const ParameterSpread& spread) { return spread.sd_percent; }));
    row.push_back(
        percents(entry, [](const ParameterSpread& spread) { return 100 * spread.mean_se / spread.mean; }));
    row.push_back(percents(entry, [](const ParameterSpread& spread) { return 100 * spread.coverage; }));
    if (compared) row.push_back(papers(entry));
    rows.push_back(std::move(row));
  }
  std::vector<std::string> header{
      "noise", "frames", "refits", "standard deviation (%)", "their own error (%)", "truth inside 95 % (%)"};
  if (compared) header.emplace_back("paper (%)");
  page.table(header, rows, fmt::format("In the order {}.", fmt::join(names, ", ")));
  if (compared) {
    std::set<int> frames;
    for (const TableEntry& entry : table.entries)
      frames.insert(entry.frames);
    add_pooled(page, table, frames);
  }
  std::vector<Figure> figures;
  for (size_t i = 0; i < known->parameters.size(); ++i)
    figures.push_back(table_figure(table, i));
  page.figures(figures);
}

}  // namespace diastole::report
