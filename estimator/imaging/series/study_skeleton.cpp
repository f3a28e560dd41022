#include "estimator/imaging/series/study_skeleton.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "estimator/imaging/series/views.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::imaging {
namespace {

namespace fs = std::filesystem;

/// The command that a series is for, with the study's name.
std::string command_for(SeriesKind kind, const std::string& images, const std::string& name) {
  switch (kind) {
    case SeriesKind::cine:
      return fmt::format("a ventricle's walls: diastole lv {} -o {}.mesh", images, name);
    case SeriesKind::velocity:
      return fmt::format("diastole flow {} -o {}.flow.csv", images, name);
    case SeriesKind::diffusion:
      return fmt::format("diastole fibres {} --study {}.study.toml -o {}.fibres.csv", images, name, name);
    default:
      return {};
  }
}

std::string parameter(const char* name, double start, double lower, double upper) {
  return fmt::format("[law.parameters.{}]\nstart = {:.1f}\nbounds = [{:.1f}, {:.1f}]\n", name, start, lower,
                     upper);
}

std::string annulus() {
  return "[specimen]\nkind = \"annulus\"\n"
         "# Measure these on the specimen; `diastole track` prints radii and height as the outlines show "
         "them.\n"
         "inner_radius_mm = 22.5\nouter_radius_mm = 50.0\nheight_mm = 85.0\nmesh = [8, 4, 1]\nends = "
         "\"fixed\"\n\n[law]\nname = \"neo-hookean\"\n" +
         parameter("C1_kPa", 6, 1, 30);
}

std::string ventricle(const std::string& name) {
  return fmt::format(
             "[specimen]\nkind = \"fitted-lv\"\nmesh_file = {}\nfibres = {}\nends = \"fixed\"\n\n"
             "[law]\nname = \"guccione\"\n",
             toml_text(name + ".mesh"), toml_text(name + ".fibres.csv")) +
         parameter("C_kPa", 2, 0.2, 12) + parameter("b1", 15, 1, 60) + parameter("b2", 3, 0.2, 20) +
         parameter("b3", 6, 0.5, 50);
}

/// [images] with the spacing of the tags, if they have one.
std::string protocol_of(const ImageFolder& folder) {
  const std::vector<double> spacings_mm = tag_spacings_mm(folder);
  const auto [least, most] = std::ranges::minmax_element(spacings_mm);
  if (least == spacings_mm.end() || !is_tag_spacing(*most, *least)) return {};
  return fmt::format(
      "\n# Images with tags of another spacing are refused.\n[images]\ntag_spacing_mm = {:.2f}\n",
      0.5 * (*least + *most));
}

std::string times_of(const ImageFolder& folder) {
  std::string text = "# frame 0 is the undeformed state; of the others the images say time_s =\n#  ";
  for (const double time_ms : tagged_phases(folder).times_ms)
    text += fmt::format(" {:.4f}", 1e-3 * time_ms);
  return text + "\n";
}

}  // namespace

std::string study_skeleton(const ImageFolder& folder, const fs::path& study) {
  std::string name = study.filename().string();
  for (const std::string ending : {".toml", ".study"}) {
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  }
  const std::string images = fs::relative(folder.folder, fs::absolute(study).parent_path()).generic_string();
  std::string text = "format = \"diastole-study\"\nversion = 1\n\n# The images:\n";
  for (const ImageSeries& series : folder.series) {
    text += fmt::format("#   series {}: {}, {}, {} slices, {} phases\n", series.number, describe(series.kind),
                        view_in_words(folder, series), series.slices.size(), series.phases.times_ms.size());
    for (const TagWave& tag : series.slices.front().tags)
      text += fmt::format("#     tags every {:.2f} mm\n", tag.spacing_mm());
    const std::string command = command_for(series.kind, images, name);
    if (!command.empty() && command.find('\n') == std::string::npos)
      text += fmt::format("#     {}\n", command);
  }
  const bool is_heart = std::ranges::count(folder.series, SeriesKind::diffusion, &ImageSeries::kind) > 0;
  text += is_heart ? "\n# Diffusion was imaged: taken to be a heart (docs/heart.md).\n" + ventricle(name)
                   : "\n# Of a heart docs/heart.md tells the specimen and the law.\n" + annulus();
  text += "\n[data]\n";
  const auto tagged = std::ranges::find(folder.series, SeriesKind::tagged_cine, &ImageSeries::kind);
  if (tagged == folder.series.end()) {
    text += "# These images have no tags: name what was measured of the motion, tags = ... or points = ...\n";
  } else {
    text += "# `diastole fit` tracks the images first, and keeps the tags beside this file.\n";
    text += fmt::format("images = {}\n", toml_text(images));
  }
  text += "# diastole bin RUN --frame-times ... --frames-csv FILE\n";
  text += fmt::format("frames = {}\n", toml_text(name + ".frames.csv"));
  if (tagged != folder.series.end()) text += times_of(folder) + protocol_of(folder);
  if (tagged != folder.series.end() && is_heart)
    text +=
        "\n# The mesh that `diastole lv` fits lies in the patient's coordinates.\n[images.to_specimen]\n"
        "origin_mm = [0.0, 0.0, 0.0]\nx_axis = [1.0, 0.0, 0.0]\ny_axis = [0.0, 1.0, 0.0]\n"
        "z_axis = [0.0, 0.0, 1.0]\n";
  return text + "\n[model]\neffects = []\n";
}

}  // namespace diastole::imaging
