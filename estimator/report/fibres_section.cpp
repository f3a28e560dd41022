#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "estimator/io/tracking_file.hpp"
#include "estimator/report/bitmap.hpp"
#include "estimator/report/colour_scale.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

const ColourScale& helix_scale() {
  static const ColourScale scale{.range = {-90, 90}, .colour = map_colour};
  return scale;
}

/// Strokes as long as a node's share of the wall, in the colour of their helix angle.
std::string layer_drawing(const FibreLayerRecord& layer) {
  constexpr double per_mm = 2.6, half_mm = 2.2, margin = 10;
  if (layer.x_mm.empty()) return drawing(1, 1, "");
  const auto [left, right] = std::minmax_element(layer.x_mm.begin(), layer.x_mm.end());
  const auto [low, high] = std::minmax_element(layer.y_mm.begin(), layer.y_mm.end());
  const auto x = [from = *left](double mm) { return margin + per_mm * (mm - from); };
  const auto y = [from = *high](double mm) { return margin + per_mm * (from - mm); };
  std::string body;
  for (size_t i = 0; i < layer.x_mm.size(); ++i) {
    const double dx = half_mm * layer.along_x[i], dy = half_mm * layer.along_y[i];
    body +=
        fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="2"/>)",
                    x(layer.x_mm[i] - dx), y(layer.y_mm[i] - dy), x(layer.x_mm[i] + dx),
                    y(layer.y_mm[i] + dy), map_colour(helix_scale().fraction_of(layer.helix_deg[i])));
  }
  return drawing(x(*right) + margin, y(*low) + margin, body);
}

SvgPlot course_plot(const FibresRecord& fibres) {
  SvgPlot plot({.x = {.label = "depth in the wall, 0 inside, 1 outside", .from = 0, .to = 1},
                .y = {.label = "helix angle (degrees)"}});
  plot.band(fibres.depth, fibres.helix_low_deg, fibres.helix_high_deg, "a",
            "10 to 90 % of the wall's places");
  plot.line(fibres.depth, fibres.helix_deg, "a", "median");
  return plot;
}

std::string pictures(const FibresRecord& fibres) {
  constexpr double side = 128, gap = 6;
  constexpr size_t in_row = 6;
  const double width = fibres.columns, height = fibres.rows * fibres.pixel_aspect;
  const double scale = side / std::max(width, height);
  std::string body;
  for (size_t k = 0; k < fibres.pictures.size(); ++k)
    body += fmt::format(
        R"svg(<g transform="translate({:.1f} {:.1f})"><image width="{:.2f}" height="{:.2f}" preserveAspectRatio="none" style="image-rendering:pixelated" href="{}"/></g>)svg",
        static_cast<double>(k % in_row) * (side + gap), static_cast<double>(k / in_row) * (side + gap),
        scale * width, scale * height,
        bitmap(bytes_of_base64(fibres.pictures[k].angle), fibres.rows, fibres.columns));
  const double lines = std::ceil(static_cast<double>(fibres.pictures.size()) / in_row);
  return drawing(in_row * (side + gap), lines * (side + gap), body);
}

}  // namespace

void add_fibres(Page& page, const FibresRecord& fibres) {
  const bool has_field = fibres.wall_voxels > 0;
  if (has_field)
    page.headline("Fibre field", fmt::format("\u00b1 {:.1f}\u00b0", fibres.sigma_deg),
                  "standard error of the direction in the middle of its places");
  page.headline("Mean diffusivity", fmt::format("{:.3f}e-3 mm\u00b2/s", fibres.md), "median of the voxels");
  page.headline("FA", fmt::format("{:.3f}", fibres.fa),
                fmt::format("noise alone makes {:.3f}", fibres.fa_of_noise));
  page.section("Fibres from diffusion",
               fmt::format("{}, {}: {} volumes of {} slices, {} directions, b up to {:.0f} s/mm\u00b2.",
                           std::filesystem::path(fibres.folder).lexically_normal().generic_string(),
                           fibres.series, fibres.volumes, fibres.slices, fibres.directions,
                           fibres.b_values.empty() ? 0.0 : fibres.b_values.back()));
  add_findings(page, fibres.findings);
  if (has_field) {
    std::vector<Figure> layers;
    for (const FibreLayerRecord& layer : fibres.layers)
      layers.push_back({layer_drawing(layer), layer.name + ", the near half, base above"});
    page.figures(layers);
    page.figures(
        {{drawing(90, 170, colour_bar(helix_scale(), "helix (deg)", {.left = 6, .top = 24, .height = 130})),
          "Positive climbs towards the base anticlockwise, seen from the base."},
         {course_plot(fibres).svg(), "The fitted field's helix angle through the wall."}});
  }
  page.section("Images", "");
  page.figures({{pictures(fibres),
                 "Angle of each voxel's first eigenvector to the image plane: white lies in it, grey stands "
                 "across. Black "
                 "has no fibre."}});
  std::vector<Page::Row> rows{{"signal to noise without weighting", fmt::format("{:.0f}", fibres.snr)},
                              {"images left out as outliers", std::to_string(fibres.outliers)}};
  if (!fibres.axes.empty())
    rows.push_back(
        {"gradient axes", fmt::format("{}; fibres at one depth agree by {:.2f}, as the headers say by {:.2f}",
                                      fibres.axes, fibres.axes_agreement, fibres.axes_agreement_as_said)});
  if (has_field) {
    rows.push_back({"voxels in the wall", std::to_string(fibres.wall_voxels)});
    rows.push_back({"single voxels from the field", fmt::format("{:.1f}\u00b0 RMS", fibres.rms_deg)});
  }
  page.table({"what", ""}, rows, "", 1);
}

}  // namespace diastole::report
