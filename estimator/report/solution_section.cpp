#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <optional>

#include "estimator/report/html_text.hpp"
#include "estimator/report/section_map.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"

namespace diastole::report {
namespace {

/// What is drawn: along the fibres where there are fibres, else around the cavity.
std::vector<MapChoice> maps_of(const SolutionRecord& record) {
  if (record.fibres) {
    return {{"stress_ff_kPa", "σ ff (kPa)", "Cauchy stress along the fibres"},
            {"strain_ff", "E ff", "Green strain of the fibres"},
            {"stress_rr_kPa", "σ rr (kPa)", "Cauchy stress across the wall"}};
  }
  return {{"stress_cc_kPa", "σ cc (kPa)", "Cauchy stress around the cavity"},
          {"strain_cc", "E cc", "Green strain around the cavity"},
          {"stress_rr_kPa", "σ rr (kPa)", "Cauchy stress across the wall"}};
}

std::string pressure_words(const SolutionRecord& record) {
  return fmt::format("at {} kPa", chosen(record.pressure_kPa));
}

/// Three components of strain or stress against the depth in the wall.
std::optional<Figure> profile_figure(const SolutionProfile& profile, const char* kind, const char* unit,
                                     const std::array<std::pair<const char*, const char*>, 3>& entries,
                                     const std::string& words) {
  const bool stress = std::string_view(kind) == "stress";
  SvgPlot plot({.x = {.label = "depth in the wall, undeformed (mm)"},
                .y = {.label = stress ? "Cauchy stress (kPa)" : "Green strain"}});
  constexpr std::array<const char*, 3> styles{"a", "b", "c"};
  for (size_t i = 0; i < entries.size(); ++i) {
    const NamedField* field =
        find_field(profile.fields, fmt::format("{}_{}{}", kind, entries[i].first, unit));
    if (field == nullptr) return {};
    plot.line(profile.depth_mm, field->values, styles[i], entries[i].second);
  }
  return Figure{plot.svg(), profile.title + ": " + words};
}

void add_profiles(Page& page, const SolutionRecord& record) {
  constexpr std::array<std::pair<const char*, const char*>, 3> wall{
      {{"cc", "circumferential"}, {"ll", "longitudinal"}, {"rr", "radial"}}};
  constexpr std::array<std::pair<const char*, const char*>, 3> fibre{
      {{"ff", "fibre"}, {"ss", "cross-fibre"}, {"nn", "normal"}}};
  for (const SolutionProfile& profile : record.profiles) {
    if (profile.depth_mm.size() < 2) continue;
    const auto add = [&](const auto& entries, const char* axes) {
      std::vector<Figure> row;
      if (auto stress =
              profile_figure(profile, "stress", "_kPa", entries, fmt::format("stress along {}.", axes)))
        row.push_back(*std::move(stress));
      if (auto strain = profile_figure(profile, "strain", "", entries, fmt::format("strain along {}.", axes)))
        row.push_back(*std::move(strain));
      page.figures(row);
    };
    add(wall, "the wall's axes");
    if (record.fibres) add(fibre, "the fibre's axes");
  }
}

/// What the wall's faces say about the mesh: the radial stress there should be minus the pressure on them.
void add_traction(Page& page, const SolutionRecord& record) {
  if (record.profiles.empty()) return;
  const NamedField* radial = find_field(record.profiles.front().fields, "stress_rr_kPa");
  if (radial == nullptr || radial->values.size() < 2) return;
  page.headline(
      "Radial stress at the inner face", fmt::format("{} kPa", number(radial->values.front(), 3)),
      fmt::format("minus the pressure if the mesh is fine enough; {} kPa at the outer face, where it is 0",
                  number(radial->values.back(), 2)));
}

}  // namespace

void add_solution(Page& page, const SolutionRecord& record) {
  if (record.cavity_volume_mL && record.cavity_volume_change_mL) {
    page.headline("Cavity", fmt::format("{} mL", number(*record.cavity_volume_mL, 4)),
                  fmt::format("{} mL more than at rest, {}", number(*record.cavity_volume_change_mL, 4),
                              pressure_words(record)));
  }
  add_traction(page, record);
  std::vector<std::string> parameters;
  for (const auto& [name, value] : record.parameters)
    parameters.push_back(fmt::format("{} {}", name, chosen(value)));
  page.section("Strain and stress inside",
               fmt::format("Study {}: {} law with {}, {}, on {} ({} unknowns).",
                           std::filesystem::path(record.study).filename().string(), record.law,
                           fmt::join(parameters, ", "), pressure_words(record),
                           record.mesh.empty() ? "a mesh of its own"
                                               : fmt::format("{} elements", fmt::join(record.mesh, " × ")),
                           record.unknowns));
  page.paragraph(
      "Sections show the material that lay in a plane, undeformed on the left and as it lies under load on "
      "the right, the undeformed outline in grey. Thin lines are the elements' borders; a jump of colour "
      "across one is the mesh's own error. Colours end at the 2nd and the 98th hundredth of the values: "
      "stress is singular where a corner is bonded to a plate.");
  for (const MapChoice& map : maps_of(record))
    page.figures(section_maps(record.sections, map, pressure_words(record)));
  add_profiles(page, record);
}

}  // namespace diastole::report
