#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "estimator/report/html_text.hpp"
#include "estimator/report/section_map.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

constexpr MapChoice maps[] = {
    {"residual_rms", "residual / σ",
     "how far the nearest 40 measured numbers lie from the field, in units of their sigma; 1 is as stated"},
    {"se_mm", "error (mm)",
     "standard error of a component of the displacement, the smoothing's own share included"},
    {"unseen", "unseen share",
     "share of the motion that the data say nothing about by themselves: only smoothness fills it in"},
    {"volume_ratio", "J",
     "local volume over the undeformed one, which the reconstruction does not hold at 1"},
};

Figure validation_figure(const ReconstructionRecord& record) {
  SvgPlot plot({.x = {.label = "log10 of the smoothing weight λ"},
                .y = {.label = "cross-validation score / its least"}});
  constexpr std::array<const char*, 3> styles{"muted", "b", "a"};
  std::vector<double> chosen_places;
  const size_t shown = std::min<size_t>(3, record.curves.size());
  for (size_t i = 0; i < shown; ++i) {
    // The first, the middle and the last frame.
    const size_t at = shown == 1 ? 0 : i * (record.curves.size() - 1) / (shown - 1);
    const CrossValidationCurve& curve = record.curves[at];
    if (curve.score.empty()) continue;
    const double least = *std::min_element(curve.score.begin(), curve.score.end());
    std::vector<double> exponents, scores;
    for (size_t j = 0; j < curve.lambda.size(); ++j) {
      if (curve.score[j] > 2.0 * least) continue;  // far from the minimum nothing is decided
      exponents.push_back(std::log10(curve.lambda[j]));
      scores.push_back(curve.score[j] / least);
    }
    plot.line(exponents, scores, styles[i + 3 - shown], fmt::format("frame {}", curve.frame));
    plot.points(exponents, scores, styles[i + 3 - shown]);
    chosen_places.push_back(std::log10(record.frames[at].lambda));
  }
  plot.marks(chosen_places, "muted");
  return {plot.svg(),
          "Generalised cross-validation: each frame takes the λ of its least score (upright lines)."};
}

Figure residual_figure(const ReconstructionRecord& record) {
  return {residual_histogram(record.residual_edges, record.residual_counts).svg(),
          "Residuals of all frames; the outermost bars hold all that is farther out."};
}

void add_frames(Page& page, const ReconstructionRecord& record) {
  std::vector<std::vector<std::string>> rows;
  for (const ReconstructedFrame& frame : record.frames) {
    rows.push_back({fmt::format("{}", frame.frame), number(frame.pressure_kPa, 4),
                    fmt::format("{}", frame.rows), fmt::format("{}", frame.wild + frame.not_found),
                    number(frame.chi2_per_dof, 3), fmt::format("{:.0f}", frame.degrees_of_freedom),
                    with_error(frame.motion, frame.motion_se), number(frame.largest_displacement_mm, 3),
                    number(frame.mean_se_mm, 2),
                    with_error(100 * (frame.volume_ratio - 1), 100 * frame.volume_ratio_se),
                    number(100 * frame.volume_error_rms, 2)});
  }
  page.table({"frame", "pressure (kPa)", "numbers", "left out", "χ²/dof", "freedoms", "motion",
              "largest (mm)", "error (mm)", "volume (%)", "|J − 1| (%)"},
             rows,
             "Motion is measured along the last frame's; freedoms are the effective number of parameters "
             "that the field took from the data; error is the standard error of a displacement component; |J "
             "− 1| is the RMS over the body.");
}

void add_families(Page& page, const ReconstructionRecord& record) {
  if (record.families.empty()) return;
  std::vector<std::string> header{"tag direction", "points", "χ²/dof"};
  for (const ReconstructedFrame& frame : record.frames)
    header.push_back(fmt::format("frame {}", frame.frame));
  std::vector<std::vector<std::string>> rows;
  for (const ReconstructedFamily& family : record.families) {
    std::vector<std::string>& row = rows.emplace_back();
    row = {fmt::format("({:.2f}, {:.2f}, {:.2f})", family.normal[0], family.normal[1], family.normal[2]),
           fmt::format("{}", family.rows), number(family.chi2_per_dof, 3)};
    for (const double chi2 : family.by_frame)
      row.push_back(number(chi2, 3));
  }
  page.table(header, rows, "χ² per degree of freedom of each tag direction, 1 if sigma is right.");
  rows.clear();
  for (const ReconstructedSlice& slice : record.slices) {
    rows.push_back({slice.where, fmt::format("{}", slice.rows), with_error(slice.offset_mm, slice.se_mm),
                    slice.displaced ? "misplaced" : ""});
  }
  page.table({"slice", "points", "offset (mm)", ""}, rows,
             "A common offset of each slice's tags along their normal, if it alone were misplaced.");
}

void add_elements(Page& page, const ReconstructionRecord& record) {
  constexpr size_t shown = 8;
  std::vector<ReconstructedElement> worst = record.elements;
  std::sort(worst.begin(), worst.end(), [](const auto& a, const auto& b) { return a.se_mm > b.se_mm; });
  worst.resize(std::min(shown, worst.size()));
  std::vector<std::vector<std::string>> rows;
  for (const ReconstructedElement& element : worst) {
    rows.push_back({fmt::format("{}", element.element), fmt::format("{}", element.rows),
                    number(element.weakest_rows, 3),
                    fmt::format("({:.2f}, {:.2f}, {:.2f})", element.weakest_direction[0],
                                element.weakest_direction[1], element.weakest_direction[2]),
                    number(element.se_mm, 3), number(100 * element.unseen, 3),
                    with_error(100 * (element.volume_ratio - 1), 100 * element.volume_ratio_se)});
  }
  page.table({"element", "numbers", "along the weakest direction", "which is", "error (mm)", "unseen (%)",
              "volume (%)"},
             rows, fmt::format("The worst-covered elements of frame {}.", record.frames.back().frame));
  rows.clear();
  for (size_t i = 0; i < std::min<size_t>(4, record.simple_motions.size()); ++i) {
    const ReconstructedMode& mode = record.simple_motions[i];
    rows.push_back({mode.words, std::isfinite(mode.se_mm) ? number(mode.se_mm, 2) : "unseen"});
  }
  page.table({"motion of the whole body", "known to (mm RMS)"}, rows,
             "Of shifts, turns, stretches and shears, what the data know least.");
}

}  // namespace

void add_findings(Page& page, const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    const bool ends = finding.what.ends_with('.') || finding.what.ends_with('?');
    const std::string text = fmt::format("{}{}{}{} {}", finding.where, finding.where.empty() ? "" : ": ",
                                         finding.what, ends ? "" : ".", finding.remedy);
    if (finding.severity == Severity::note) {
      page.paragraph(text);
    } else {
      page.warning(text);
    }
  }
}

void add_reconstruction(Page& page, const ReconstructionRecord& record) {
  page.section(
      "Displacement from the images",
      fmt::format(
          "Study {}: {} on {}, smoothness weights {} and {} on first and second derivatives (length {} mm), "
          "λ by generalised cross-validation; {:.0f} of {} modes are seen without smoothness.",
          std::filesystem::path(record.study).filename().string(), record.data,
          record.mesh.empty() ? "a mesh of its own"
                              : fmt::format("{} elements", fmt::join(record.mesh, " × ")),
          chosen(record.smoothing[0]), chosen(record.smoothing[1]), chosen(record.smoothing[2]),
          record.modes_seen, record.unknowns));
  add_findings(page, record.findings);
  if (record.findings.empty()) page.paragraph("Nothing was found wrong with the data.");
  if (record.frames.empty()) {
    page.paragraph("Nothing was reconstructed.");
    return;
  }
  const ReconstructedFrame& last = record.frames.back();
  page.headline("Largest displacement", fmt::format("{} mm", number(last.largest_displacement_mm, 3)),
                fmt::format("frame {}; components known to ± {} mm", last.frame, number(last.mean_se_mm, 2)));
  page.headline("Data against the field", fmt::format("χ²/dof {}", number(last.chi2_per_dof, 3)),
                "1 if the points scatter as their sigma says");
  add_frames(page, record);
  for (const MapChoice& map : maps)
    page.figures(section_maps(record.sections, map, fmt::format("frame {}", last.frame)));
  if (!record.residual_counts.empty()) page.figures({validation_figure(record), residual_figure(record)});
  add_families(page, record);
  add_elements(page, record);
}

}  // namespace diastole::report
