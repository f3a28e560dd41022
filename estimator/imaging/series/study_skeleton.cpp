#include "estimator/imaging/series/study_skeleton.hpp"

#include <fmt/format.h>

#include "estimator/imaging/series/views.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::imaging {

std::string study_skeleton(const ImageFolder& folder, const std::filesystem::path& study) {
  std::string name = study.filename().string();
  for (const std::string ending : {".toml", ".study"}) {
    if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  }
  std::string text = "format = \"diastole-study\"\nversion = 1\n\n# The images:\n";
  for (const ImageSeries& series : folder.series) {
    text += fmt::format("#   series {}: {}, {}, {} slices, {} phases\n", series.number, describe(series.kind),
                        view_in_words(folder, series), series.slices.size(), series.phases.times_ms.size());
    for (const TagWave& tag : series.slices.front().tags)
      text += fmt::format("#     tags every {:.2f} mm\n", tag.spacing_mm());
  }
  text +=
      "\n[specimen]\nkind = \"annulus\"\n"
      "# Measure these on the specimen; `diastole track` prints radii and height as the outlines show them.\n"
      "inner_radius_mm = 22.5\nouter_radius_mm = 50.0\nheight_mm = 85.0\nmesh = [8, 4, 1]\nends = "
      "\"fixed\"\n\n"
      "[law]\nname = \"neo-hookean\"\n[law.parameters.C1_kPa]\nstart = 6.0\nbounds = [1.0, 30.0]\nvary = "
      "\"whole\"\n\n[data]\n";
  namespace fs = std::filesystem;
  const fs::path images = fs::relative(folder.folder, fs::absolute(study).parent_path());
  text += "# `diastole fit` tracks the images first, and keeps the tags beside this file.\n";
  text += fmt::format("images = {}\n", toml_text(images.generic_string()));
  text += "# diastole bin RUN --frame-times ... --frames-csv FILE\n";
  text += fmt::format("frames = {}\n", toml_text(name + ".frames.csv"));
  for (const ImageSeries& series : folder.series) {
    if (series.kind != SeriesKind::tagged_cine) continue;
    text += "# frame 0 is the undeformed state; of the others the images say time_s =\n#  ";
    for (const double time_ms : series.phases.times_ms)
      text += fmt::format(" {:.4f}", 1e-3 * time_ms);
    text += "\n";
    break;
  }
  return text + "\n[model]\neffects = []\n";
}

}  // namespace diastole::imaging
