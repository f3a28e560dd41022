#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "estimator/report/cine.hpp"
#include "estimator/report/embedded.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"

namespace diastole::report {
namespace {

size_t phases_of(const TrackingRecord& record) {
  size_t most = 0;
  for (const TrackedSliceImages& slice : record.slices)
    most = std::max(most, slice.images.size());
  return most;
}

std::string player(const TrackedSliceImages& slice, size_t number) {
  return fmt::format(
      R"(<figure class="cine" data-slice="{}"><div class="cine-view"><canvas role="img" aria-label="{}"></canvas><output class="cine-at"></output></div>
<div class="cine-bar"><button type="button" class="cine-play" aria-label="play or stop">&#9654;</button><input type="range" class="cine-phase" min="0" max="{}" value="0" aria-label="phase"><output class="cine-time"></output></div>
<div class="cine-residual"></div>
<figcaption>{}, {}: {} &#215; {} pixels of {:.3g} &#215; {:.3g} mm.</figcaption></figure>
)",
      number, escaped(slice.name + ", " + slice.view), slice.images.size() - 1, escaped(slice.name),
      escaped(slice.view), slice.rows, slice.columns, slice.pixel_mm[1], slice.pixel_mm[0]);
}

}  // namespace

std::string cine_players(const TrackingRecord& record) {
  std::string html =
      "<div class=\"cine-tools\"><label><input type=\"checkbox\" id=\"cine-lines\" checked> lines</label>"
      "<label><input type=\"checkbox\" id=\"cine-rejected\" checked> left out</label>"
      "<label><input type=\"checkbox\" id=\"cine-outlines\" checked> outlines</label>"
      "<span class=\"cine-legend\"><span>0</span><canvas width=\"160\" height=\"10\"></canvas><span "
      "class=\"cine-most\"></span></span></div>\n"
      "<noscript><p class=\"warning\">The player needs JavaScript; the table below does "
      "not.</p></noscript>\n<div class=\"cines\">\n";
  for (size_t i = 0; i < record.slices.size(); ++i)
    html += player(record.slices[i], i);
  return html + "</div>\n";
}

std::span<const PageAsset> cine_assets() {
  static const std::array assets{PageAsset{"/page.css", "text/css", embedded::page_css},
                                 PageAsset{"/cine.css", "text/css", embedded::cine_css},
                                 PageAsset{"/cine.js", "text/javascript", embedded::cine_js}};
  return assets;
}

void add_tracking(Page& page, const TrackingRecord& record) {
  page.headline(
      "Tag points", fmt::format("{}", record.points),
      fmt::format("standard errors {:.3f} px RMS, {} coordinates", record.rms_px, record.coordinates));
  size_t dropped = 0;
  for (const DroppedCount& count : record.dropped)
    dropped += count.points;
  page.headline("Left out", fmt::format("{}", dropped), "places on the lines that cannot be trusted");
  if (record.edits) page.headline("By hand", fmt::format("{}", *record.edits), "choices that were replayed");
  page.section(
      "Images and tags",
      fmt::format(
          "{}: {} slices and directions, {} phases. Lines are the tags as followed, in the colour of their "
          "standard error; crosses are places that were left out; dashed is the tissue's edge as found.",
          std::filesystem::path(record.folder).lexically_normal().generic_string(), record.slices.size(),
          phases_of(record)));
  add_findings(page, record.findings);
  page.part(cine_players(record), embedded::cine_css,
            std::string(embedded::cine_js) + "const cine = cinePlayers(tracking);\n", "tracking",
            to_json(record));
  page.table_of(
      record.dropped, {"left out because", "places"},
      [](const DroppedCount& count) -> Page::Row {
        return {count.reason, std::to_string(count.points)};
      },
      "");
  page.table_of(
      record.slices, {"slice", "points", "standard error (px): first phase", "middle", "last"},
      [](const TrackedSliceImages& slice) -> Page::Row {
        size_t points = 0;
        for (const TrackedImage& image : slice.images)
          points += image.points.size() / 5;
        const auto sigma = [&](size_t k) { return fmt::format("{:.3f}", slice.images[k].sigma_px); };
        return {slice.name, std::to_string(points), sigma(0), sigma(slice.images.size() / 2),
                sigma(slice.images.size() - 1)};
      },
      "Standard errors of the points along their tags' normals, RMS.");
}

}  // namespace diastole::report
