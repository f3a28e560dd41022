#include <fmt/format.h>

#include <algorithm>

#include "estimator/inference/intervals.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

SvgPlot volume_plot(const VentricleRecord& heart, const std::vector<double>& phase) {
  std::vector<double> bars = numbers_of(heart.phases, &VentriclePhaseRecord::cavity_sigma_mL);
  for (double& bar : bars)
    bar *= inference::normal_95;
  const std::vector<double> cavity = numbers_of(heart.phases, &VentriclePhaseRecord::cavity_mL);
  SvgPlot plot({.x = {.label = "phase"}, .y = {.label = "volume (mL)"}});
  plot.error_bars(phase, cavity, bars, "a");
  plot.line(phase, cavity, "a", "cavity");
  plot.points(phase, cavity, "a small");
  plot.line(phase, numbers_of(heart.phases, &VentriclePhaseRecord::wall_mL), "muted", "wall");
  return plot;
}

SvgPlot thickness_plot(const VentricleRecord& heart, const std::vector<double>& phase) {
  SvgPlot plot({.x = {.label = "phase"}, .y = {.label = "wall thickness (mm)"}});
  plot.band(phase, numbers_of(heart.phases, &VentriclePhaseRecord::least_thickness_mm),
            numbers_of(heart.phases, &VentriclePhaseRecord::most_thickness_mm), "c", "least to most");
  plot.line(phase, numbers_of(heart.phases, &VentriclePhaseRecord::thickness_mm), "c", "mean");
  return plot;
}

SvgPlot section_plot(const VentricleSectionRecord& section) {
  SvgPlot plot({.x = {.label = "from the long axis (mm)"},
                .y = {.label = "height (mm)"},
                .width = 360,
                .height = 420,
                .equal_scale = true});
  plot.line(section.inner_r, section.inner_z, "a", "endocardium");
  plot.line(section.outer_r, section.outer_z, "b", "epicardium");
  if (!section.small_r.empty()) plot.line(section.small_r, section.small_z, "muted", "smallest cavity");
  plot.points(section.inner_point_r, section.inner_point_z, "a small");
  plot.points(section.outer_point_r, section.outer_point_z, "b small");
  return plot;
}

}  // namespace

void add_ventricle(Page& page, const VentricleRecord& heart) {
  const auto chosen =
      std::find_if(heart.phases.begin(), heart.phases.end(),
                   [&](const VentriclePhaseRecord& phase) { return phase.phase == heart.phase; });
  page.headline("Cavity", with_error(chosen->cavity_mL, chosen->cavity_sigma_mL) + " mL",
                fmt::format("in phase {}, whose mesh this is", heart.phase));
  if (heart.phases.size() > 1)
    page.headline("Ejection", with_error(100 * heart.ejection, 100 * heart.ejection_sigma) + " %",
                  "of the largest cavity");
  page.headline("Points", fmt::format("{:.2f} mm", heart.rms_mm),
                fmt::format("RMS from their walls: {:.2f} times the errors stated", heart.noise_factor));
  page.section("Walls", fmt::format("From {}.", heart.source));
  add_findings(page, heart.findings);
  std::vector<Figure> sections;
  for (const VentricleSectionRecord& section : heart.sections)
    sections.push_back({section_plot(section).svg(), section.title});
  page.figures(sections);
  if (heart.phases.size() > 1) {
    const std::vector<double> phase = numbers_of(heart.phases, &VentriclePhaseRecord::phase);
    page.section(
        "Over the cycle",
        "Bars are intervals of 95 %. A wall's volume hardly changes: how much it does here is a check.");
    page.figures({{volume_plot(heart, phase).svg(), "Volumes of cavity and wall."},
                  {thickness_plot(heart, phase).svg(), "Thickness of the wall's sides."}});
  }
  page.table_of(
      heart.phases,
      {"phase", "cavity (mL)", "±", "wall (mL)", "thickness (mm)", "least", "most", "points' RMS (mm)"},
      [](const VentriclePhaseRecord& phase) -> Page::Row {
        return {std::to_string(phase.phase),
                fmt::format("{:.2f}", phase.cavity_mL),
                fmt::format("{:.2f}", phase.cavity_sigma_mL),
                fmt::format("{:.2f}", phase.wall_mL),
                fmt::format("{:.2f}", phase.thickness_mm),
                fmt::format("{:.2f}", phase.least_thickness_mm),
                fmt::format("{:.2f}", phase.most_thickness_mm),
                fmt::format("{:.2f}", phase.rms_mm)};
      },
      "Standard errors.");
  page.section("Slices", "By how much each was displaced in its plane when its breath was held.");
  page.table_of(
      heart.slices, {"slice", "displaced by (mm)", "±"},
      [](const VentricleSliceRecord& slice) -> Page::Row {
        if (slice.is_reference) return {slice.slice, "reference", ""};
        return {slice.slice, fmt::format("{:.2f}", slice.shift_mm), fmt::format("{:.2f}", slice.sigma_mm)};
      },
      "Standard errors of a component.");
}

}  // namespace diastole::report
