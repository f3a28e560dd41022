#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "estimator/inference/intervals.hpp"
#include "estimator/report/bitmap.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

using inference::normal_95;

/// One dimension of a band of 95 %.
std::vector<double> shifted(const std::vector<double>& values, const std::vector<double>& sigmas, double z) {
  std::vector<double> result = values;
  for (size_t i = 0; i < result.size(); ++i)
    result[i] += z * sigmas[i];
  return result;
}

SvgPlot curve_plot(const FlowRecord& flow, const std::vector<double>& curve, const std::vector<double>& sigma,
                   const char* label, const std::vector<double>& points, const std::vector<double>& errors) {
  SvgPlot plot({.x = {.label = "time after the trigger (s)"}, .y = {.label = label}});
  plot.band(flow.time_s, shifted(curve, sigma, -normal_95), shifted(curve, sigma, normal_95), "a", "95 %");
  plot.line(flow.time_s, curve, "a");
  const std::vector<double> times = numbers_of(flow.phases, &FlowPhaseRecord::phase_s);
  std::vector<double> bars = errors;
  for (double& bar : bars)
    bar *= normal_95;
  plot.error_bars(times, points, bars, "b");
  plot.points(times, points, "b small", "image phases");
  return plot;
}

/// Pressure over volume, with each point's intervals in both directions, and the loop closed.
SvgPlot loop_plot(const FlowRecord& flow) {
  std::vector<double> volume = numbers_of(flow.loop, &LoopPointRecord::volume_mL);
  std::vector<double> pressure = numbers_of(flow.loop, &LoopPointRecord::pressure_kPa);
  const std::vector<double> sigma_kPa = numbers_of(flow.loop, &LoopPointRecord::pressure_sigma_kPa);
  SvgPlot plot({.x = {.label = "volume above its least (mL)"}, .y = {.label = "cavity pressure (kPa)"}});
  std::vector<double> bars = sigma_kPa;
  for (double& bar : bars)
    bar *= normal_95;
  plot.error_bars(volume, pressure, bars, "muted");
  for (const LoopPointRecord& point : flow.loop) {
    const std::vector<double> across{point.volume_mL - normal_95 * point.volume_sigma_mL,
                                     point.volume_mL + normal_95 * point.volume_sigma_mL};
    plot.line(across, std::vector<double>{point.pressure_kPa, point.pressure_kPa}, "muted thin");
  }
  volume.push_back(volume.front());
  pressure.push_back(pressure.front());
  plot.line(volume, pressure, "a", "once around");
  return plot;
}

SvgPlot stiffness_plot(const FlowRecord& flow) {
  const std::vector<double> time = numbers_of(flow.loop, &LoopPointRecord::phase_s);
  const std::vector<double> stiffness = numbers_of(flow.loop, &LoopPointRecord::stiffness_kPa_per_mL);
  const std::vector<double> sigma = numbers_of(flow.loop, &LoopPointRecord::stiffness_sigma_kPa_per_mL);
  SvgPlot plot(
      {.x = {.label = "time after the trigger (s)"}, .y = {.label = "dp/dV along the loop (kPa/mL)"}});
  std::vector<double> known_s, known, bars;
  for (size_t i = 0; i < time.size(); ++i) {
    if (std::isnan(stiffness[i])) continue;
    known_s.push_back(time[i]);
    known.push_back(stiffness[i]);
    bars.push_back(normal_95 * sigma[i]);
  }
  plot.error_bars(known_s, known, bars, "muted");
  plot.line(time, stiffness, "c");
  plot.points(known_s, known, "c small");
  return plot;
}

/// All phases side by side with the lumen's outline.
std::string strip(const FlowRecord& flow, std::string FlowImageRecord::*picture) {
  constexpr double side = 108, gap = 6, words = 16;
  constexpr size_t in_row = 8;
  const double scale = side / std::max(flow.rows, flow.columns);
  std::string body;
  for (size_t k = 0; k < flow.images.size(); ++k) {
    const FlowImageRecord& image = flow.images[k];
    const double x = static_cast<double>(k % in_row) * (side + gap),
                 y = static_cast<double>(k / in_row) * (side + gap + words);
    body += fmt::format(
        R"svg(<g transform="translate({:.1f} {:.1f})"><image width="{:.2f}" height="{:.2f}" preserveAspectRatio="none" style="image-rendering:pixelated" href="{}"/>)svg",
        x, y, scale * flow.columns, scale * flow.rows,
        bitmap(bytes_of_base64(image.*picture), flow.rows, flow.columns));
    std::string path;
    for (size_t i = 0; i + 1 < image.outline.size(); i += 2)
      path += fmt::format("{}{:.2f} {:.2f}", i == 0 ? "M" : "L", scale * (image.outline[i] + 0.5),
                          scale * (image.outline[i + 1] + 0.5));
    body += fmt::format(
        R"(<path class="ring" style="stroke-width:1.4" d="{}Z"/><text x="0" y="{:.1f}">{:.0f} ms</text></g>)",
        path, scale * flow.rows + 12, 1e3 * image.phase_s);
  }
  const double lines = std::ceil(static_cast<double>(flow.images.size()) / in_row);
  return drawing(in_row * (side + gap), lines * (side + gap + words), body);
}

std::string interval(double value, double sigma, const char* unit) {
  return fmt::format("95 % interval {} to {} {}", number(value - normal_95 * sigma),
                     number(value + normal_95 * sigma), unit);
}

}  // namespace

void add_flow(Page& page, const FlowRecord& flow) {
  page.headline("Stroke volume", with_error(flow.stroke_mL, flow.stroke_sigma_mL) + " mL",
                interval(flow.stroke_mL, flow.stroke_sigma_mL, "mL"));
  if (!flow.pressure_source.empty())
    page.headline("Work of a cycle", with_error(flow.work_mJ, flow.work_sigma_mJ) + " mJ",
                  interval(flow.work_mJ, flow.work_sigma_mJ, "mJ"));
  page.headline("Not returned", with_error(flow.closure_mL, flow.closure_sigma_mL) + " mL",
                flow.is_closed ? "by the cycle as measured; corrected here" : "by the cycle, as measured");
  page.section("Flow and volume",
               fmt::format("{}, {}: a venc of {:.4g} cm/s by {}; the flow repeats after {:.4g} s.",
                           std::filesystem::path(flow.folder).lexically_normal().generic_string(),
                           flow.series, flow.venc_cm_s, flow.venc_source, flow.interval_s));
  add_findings(page, flow.findings);
  page.figures(
      {{curve_plot(flow, flow.flow_mL_s, flow.flow_sigma_mL_s, "flow along the slice's normal (mL/s)",
                   numbers_of(flow.phases, &FlowPhaseRecord::flow_mL_s),
                   numbers_of(flow.phases, &FlowPhaseRecord::flow_sigma_mL_s))
            .svg(),
        "Flow of each image phase and the periodic curve through them."},
       {curve_plot(flow, flow.volume_mL, flow.volume_sigma_mL, "volume above its least (mL)",
                   numbers_of(flow.phases, &FlowPhaseRecord::volume_mL),
                   numbers_of(flow.phases, &FlowPhaseRecord::volume_sigma_mL))
            .svg(),
        "Its integral: the volume that the flow has brought."}});
  if (!flow.pressure_source.empty()) {
    page.section("Pressure-volume loop",
                 fmt::format("With the pressure of {}, averaged over the cycles.", flow.pressure_source));
    page.figures(
        {{loop_plot(flow).svg(), "Once around; grey bars are intervals of 95 % of pressure and volume."},
         {stiffness_plot(flow).svg(), "Stiffness along the loop, where the flow does not turn."}});
  }
  page.section("Images",
               fmt::format("The lumen has {:.1f} mm\u00b2; its outline is the fit's.", flow.area_mm2));
  page.figures({{strip(flow, &FlowImageRecord::magnitude), "Magnitudes with the lumen's outline."}});
  page.figures({{strip(flow, &FlowImageRecord::velocity),
                 fmt::format("Velocities as stored, black -{0:.4g} to white {0:.4g} cm/s: where they wrap, "
                             "turns were put back.",
                             flow.venc_cm_s)}});
  const std::string background =
      flow.background_order < 0
          ? "not known"
          : fmt::format("{:.2f} \u00b1 {:.2f} cm/s at the lumen, a polynomial of order {}",
                        flow.background_cm_s, flow.background_sigma_cm_s, flow.background_order);
  page.table({"what", ""},
             {{"background taken off", background},
              {"phases with turns put back", std::to_string(flow.unwrapped)},
              {"movement of the lumen over the cycle", fmt::format("{:.2f} mm RMS", flow.movement_mm)},
              {"residual of the fit, chi-square over its expectation",
               fmt::format("{:.2f}", flow.reduced_chi_square)}},
             "", 1);
  page.table_of(
      flow.phases,
      {"time (s)", "flow (mL/s)", "\u00b1", "volume (mL)", "\u00b1", "fastest fluid (cm/s)", "turns"},
      [](const FlowPhaseRecord& phase) -> Page::Row {
        return {fmt::format("{:.4f}", phase.phase_s),
                fmt::format("{:.2f}", phase.flow_mL_s),
                fmt::format("{:.2f}", phase.flow_sigma_mL_s),
                fmt::format("{:.3f}", phase.volume_mL),
                fmt::format("{:.3f}", phase.volume_sigma_mL),
                fmt::format("{:.1f}", phase.core_cm_s),
                std::to_string(phase.turns)};
      },
      "Standard errors.");
}

}  // namespace diastole::report
