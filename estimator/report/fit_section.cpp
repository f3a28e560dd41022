#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>

#include "estimator/report/fit_figures.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

/// "C1_kPa" as "C1" and "kPa"; a name without unit has an empty second part.
std::pair<std::string, std::string> name_and_unit(const std::string& name) {
  const size_t underscore = name.rfind('_');
  if (underscore == std::string::npos) return {name, ""};
  return {name.substr(0, underscore), name.substr(underscore + 1)};
}

std::string interval_words(const FittedParameter& parameter) {
  if (!std::isfinite(parameter.ci95[0])) return "no interval: the value sits on its bound";
  const auto unit = name_and_unit(parameter.name).second;
  return fmt::format("95 % interval {} to {} {}", number(parameter.ci95[0], 4), number(parameter.ci95[1], 4),
                     unit);
}

void add_shapes(Page& page, const FitRecord& fit) {
  std::vector<std::vector<std::string>> rows;
  for (const FittedParameter& parameter : fit.parameters) {
    if (!parameter.profile && !parameter.posterior) continue;
    const auto interval = [](const std::array<double, 2>& ends) {
      return fmt::format("{} to {}", number(ends[0], 4), number(ends[1], 4));
    };
    rows.push_back({parameter.name, interval(parameter.ci95),
                    parameter.profile ? interval(parameter.profile->ci95) : "–",
                    parameter.posterior ? interval(parameter.posterior->ci95) : "–",
                    parameter.posterior ? number(parameter.posterior->r_hat, 4) : "–",
                    parameter.posterior ? number(parameter.posterior->effective_draws, 3) : "–"});
  }
  if (rows.empty()) return;
  page.table(
      {"parameter", "95 % interval", "profile", "posterior", "R-hat", "effective draws"}, rows,
      "Intervals from the likelihood's curvature, from its true shape, and from draws of the posterior.");
  std::vector<Figure> profiles;
  for (const FittedParameter& parameter : fit.parameters) {
    if (parameter.profile && parameter.profile->value.size() > 2)
      profiles.push_back(profile_figure(parameter));
  }
  page.figures(profiles);
}

void add_parameters(Page& page, const FitRecord& fit) {
  const auto row_of = [](const FittedParameter& parameter) -> Page::Row {
    return {parameter.name,
            with_error(parameter.value, parameter.se),
            fmt::format("{} to {}", number(parameter.ci95[0], 4), number(parameter.ci95[1], 4)),
            chosen(parameter.start),
            fmt::format("{} to {}", chosen(parameter.bounds[0]), chosen(parameter.bounds[1])),
            parameter.at_bound.empty() ? "no" : parameter.at_bound};
  };
  page.table_of(fit.parameters,
                {"parameter", "value ± standard error", "95 % interval", "start", "bounds", "on a bound"},
                row_of,
                "The material's parameters. Errors carry the noise of the imaged motion and of the measured "
                "pressures.");
  add_shapes(page, fit);
  for (const FittedParameter& parameter : fit.parameters) {
    if (parameter.elements.empty()) continue;
    page.figures(regional_figures(fit, parameter));
  }
}

void draw(SvgPlot& plot, const std::vector<PlaneCurve>& curves, const std::string& style,
          const std::string& name) {
  bool first = true;
  for (const PlaneCurve& curve : curves) {
    plot.line(curve.h_mm, curve.v_mm, style, first ? name : "");
    first = false;
  }
}

Figure section_figure(const FitSection& section, bool tags) {
  SvgPlot plot({.x = {.label = section.horizontal},
                .y = {.label = section.vertical},
                .width = 560,
                .height = 560,
                .equal_scale = true});
  draw(plot, section.outline_before, "muted dashed", "before");
  draw(plot, section.lines_before, "muted thin", "");
  draw(plot, section.lines_after, "a thin", "");
  draw(plot, section.outline_after, "a heavy", "fitted model");
  plot.points(section.observed.h_mm, section.observed.v_mm, "b small", "measured");
  const char* lines =
      tags ? "Thin lines are the tag planes: straight before, as the model bends them after; the dots are "
             "the tag points that were tracked there."
           : "Thin lines are a grid drawn on the material; the dots are measured points near the plane.";
  return {plot.svg(), section.title + ". " + lines};
}

Figure residual_figure(const FitRecord& fit) {
  return {
      residual_histogram(fit.residuals.edges, fit.residuals.counts).svg(),
      fmt::format("Residuals in units of their stated noise. chi²/dof = {}; {} beyond 5 standard deviations.",
                  number(fit.chi2_per_dof, 4), fit.outliers_5sigma)};
}

Figure pressure_figure(const FitRecord& fit) {
  const auto of = [&](double (*pressure_kPa)(const FittedFrame&)) {
    return numbers_of(fit.frames, [&](const FittedFrame& frame) { return 1000 * pressure_kPa(frame); });
  };
  const auto time_s = numbers_of(fit.frames, &FittedFrame::time_s);
  const auto measured = of([](const FittedFrame& f) { return f.measured_kPa - f.estimated_kPa; });
  const auto sigma = of([](const FittedFrame& f) { return f.sigma_kPa; });
  SvgPlot plot({.x = {.label = "time after the trigger (s)"}, .y = {.label = "pressure − estimate (Pa)"}});
  plot.band(time_s, of([](const FittedFrame& f) { return -f.se_kPa; }),
            of([](const FittedFrame& f) { return f.se_kPa; }), "a", "estimated ± SE");
  plot.line(time_s, std::vector<double>(time_s.size(), 0.0), "a");
  plot.error_bars(time_s, measured, sigma, "b");
  plot.points(time_s, measured, "b", "measured ± SD");
  return {plot.svg(),
          "Frame pressures: the fit treats each as unknown, tied to its measurement by the stated error. A "
          "measurement off by more than two of its bars would deserve a look."};
}

void add_frames(Page& page, const FitRecord& fit) {
  const auto row_of = [](const FittedFrame& frame) -> Page::Row {
    return {std::to_string(frame.frame),
            number(frame.time_s),
            fmt::format("{:.4f}", frame.measured_kPa),
            with_error(frame.estimated_kPa, frame.se_kPa),
            std::to_string(frame.points),
            fmt::format("{:.3f}", frame.rms_mm),
            fmt::format("{:.3f}", frame.chi2_per_point)};
  };
  page.table_of(
      fit.frames,
      {"frame", "time (s)", "measured (kPa)", "estimated (kPa)", "points", "RMS (mm)", "chi²/point"}, row_of,
      "Each frame's pressure and how well the model follows its motion.");
}

void add_course(Page& page, const FitRecord& fit) {
  std::vector<std::string> header = {"iteration", "cost"};
  for (const FittedParameter& parameter : fit.parameters)
    header.push_back(parameter.name);
  std::vector<std::vector<std::string>> rows;
  for (const FitIteration& step : fit.history) {
    std::vector<std::string> row = {std::to_string(step.iteration), number(step.cost, 7)};
    for (const double value : step.parameters)
      row.push_back(number(value, 6));
    if (!step.accepted) row.front() += " (rejected)";
    rows.push_back(std::move(row));
  }
  page.table(header, rows,
             fmt::format("The search: {} It took {} iterations, {} equilibrium solutions and {} s.",
                         fit.reason, fit.iterations, fit.forward_solves, number(fit.seconds, 2)));
}

void add_correlation(Page& page, const FitRecord& fit) {
  constexpr size_t most_columns = 12;  // a regional fit's matrix belongs into the JSON, not on paper
  if (fit.correlation.names.size() < 2 || fit.correlation.names.size() > most_columns) return;
  std::vector<std::string> header = {""};
  header.insert(header.end(), fit.correlation.names.begin(), fit.correlation.names.end());
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < fit.correlation.names.size(); ++i) {
    std::vector<std::string> row = {fit.correlation.names[i]};
    for (const double value : fit.correlation.matrix[i])
      row.push_back(fmt::format("{:+.2f}", value));
    rows.push_back(std::move(row));
  }
  page.table(header, rows,
             "Correlation of the estimates. Near ±1 two of them cannot be told apart by these data.");
}

}  // namespace

void add_fit(Page& page, const FitRecord& fit) {
  for (const FittedParameter& parameter : fit.parameters) {
    const auto [name, unit] = name_and_unit(parameter.name);
    page.headline(fmt::format("{}, {} law", name, fit.law),
                  fmt::format("{} {}", with_error(parameter.value, parameter.se), unit),
                  interval_words(parameter));
  }
  page.headline("Residual motion", fmt::format("{} mm RMS", number(fit.rms_mm, 3)),
                fmt::format("{} residuals; chi²/dof {}", fit.residuals_used, number(fit.chi2_per_dof, 3)));

  page.section(
      "The stiffness",
      fmt::format("Study {}: {} law, fitted to {} in {} loaded frames on {}.",
                  std::filesystem::path(fit.study).filename().string(), fit.law, fit.data, fit.frames.size(),
                  fit.mesh.empty() ? "a mesh of its own"
                                   : fmt::format("a mesh of {} elements", fmt::join(fit.mesh, " × "))));
  if (!fit.converged) page.warning("The fit did not converge: " + fit.reason);
  if (!fit.findings.empty()) add_findings(page, fit.findings);
  add_parameters(page, fit);
  for (const std::string& remark : fit.remarks)
    page.paragraph(remark);
  for (const Exclusion& exclusion : fit.excluded) {
    page.paragraph(fmt::format("{} points are not used: {}.", exclusion.points, exclusion.reason));
  }
  if (!fit.sections.empty()) {
    page.section(
        "Displacement, before and after",
        fmt::format(
            "The specimen at rest (grey) and in frame {} (blue) as the fitted model sees it, in millimetres.",
            fit.section_frame));
    std::vector<Figure> figures;
    for (const FitSection& section : fit.sections)
      figures.push_back(section_figure(section, fit.data != "points"));
    page.figures(figures);
  }
  page.section("How good is the fit",
               "If model, noise and pressures are right, the residuals spread like the orange curve.");
  page.figures({residual_figure(fit), pressure_figure(fit)});
  add_frames(page, fit);
  add_course(page, fit);
  add_correlation(page, fit);
}

}  // namespace diastole::report
