#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

Figure line_figure(const ShearFit& fit) {
  SvgPlot plot({.x = {.label = "ω/M (rad per N m)"}, .y = {.label = "(a⁻² − R⁻²)/8πh (1000/m³)"}});
  const auto x = numbers_of(fit.points, &ShearPoint::rotation_per_moment_rad_per_Nm);
  const auto y = numbers_of(fit.points, &ShearPoint::shape_1000_per_m3);
  const double far = std::ranges::max(x);
  const std::vector<double> ends = {0, far};
  if (fit.determined) {
    plot.band(ends, std::vector<double>{0, fit.ci95_kPa[0] * far},
              std::vector<double>{0, fit.ci95_kPa[1] * far}, "b", "95 % interval");
  }
  plot.line(ends, std::vector<double>{0, fit.C1_kPa * far}, "b", "slope C1");
  plot.points(x, y, "a", "markers");
  return {plot.svg(), fmt::format("Eq. 1, normalised: every marker under every load on one line, whose slope "
                                  "is C1. R² = {:.4f} (about zero, as the line passes through the origin).",
                                  fit.r2)};
}

Figure residual_figure(const ShearTest& test, const ShearFit& fit) {
  SvgPlot plot(
      {.x = {.label = "marker radius (mm)"}, .y = {.label = "measured − fitted rotation (degrees)"}});
  std::vector<double> radius_mm, residual_deg, wild_mm, wild_deg;
  for (size_t i = 0; i < test.rows.size(); ++i) {
    const bool wild = std::ranges::any_of(
        fit.outliers, [&](const ShearOutlier& outlier) { return outlier.line == test.rows[i].line; });
    (wild ? wild_mm : radius_mm).push_back(test.rows[i].radius_mm);
    (wild ? wild_deg : residual_deg).push_back(fit.points[i].residual_deg);
  }
  const Annulus& annulus = test.rows.front().annulus;
  plot.line(std::vector<double>{annulus.inner_radius_mm, annulus.outer_radius_mm}, std::vector<double>{0, 0},
            "muted");
  plot.points(radius_mm, residual_deg, "a", "markers");
  if (!wild_mm.empty()) plot.points(wild_mm, wild_deg, "b", "outliers");
  return {plot.svg(), fmt::format("What the line leaves: {} degrees RMS. A trend over the radius would speak "
                                  "against the geometry or the bond.",
                                  number(fit.rms_deg, 2))};
}

}  // namespace

void add_shear(Page& page, const ShearTest& test, const ShearFit& fit) {
  page.headline(
      "C1, rotational shear", fit.determined ? with_error(fit.C1_kPa, fit.se_kPa) + " kPa" : "not determined",
      fit.determined
          ? fmt::format("95 % interval {} to {} kPa", number(fit.ci95_kPa[0]), number(fit.ci95_kPa[1]))
          : "the scatter hides the rotation");
  page.section("The rotational shear test",
               fmt::format("{}: {} rows under {} loads, given as {}; the largest shear is {}.",
                           std::filesystem::path(test.file).filename().string(), test.rows.size(),
                           fit.loads.size(), test.load, number(fit.largest_shear, 2)));
  for (const std::string& remark : fit.remarks)
    page.warning(remark);
  page.figures({line_figure(fit), residual_figure(test, fit)});
  const auto row_of = [](const ShearLoad& load) -> Page::Row {
    return {number(load.moment_Nmm), std::to_string(load.rows),
            std::isfinite(load.se_kPa) ? with_error(load.C1_kPa, load.se_kPa) : number(load.C1_kPa),
            number(load.rms_deg, 2)};
  };
  page.table_of(fit.loads, {"moment (N mm)", "rows", "C1 by itself (kPa)", "RMS (degrees)"}, row_of,
                "Each load by itself. A neo-Hookean gel gives every load the same C1.");
}

}  // namespace diastole::report
