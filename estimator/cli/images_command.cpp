#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/series/study_skeleton.hpp"
#include "estimator/imaging/series/views.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

using namespace imaging;

struct ImagesArguments {
  std::filesystem::path folder;
  std::optional<std::filesystem::path> skeleton;
  bool force = false;
};

Json direction_json(const SlicePlane& plane, const TagWave& tag) {
  const Eigen::Vector3d normal = tag_normal(plane, tag);
  return {{"normal", {normal.x(), normal.y(), normal.z()}},
          {"spacing_mm", tag.spacing_mm()},
          {"modulation", tag.modulation}};
}

Json series_json(const ImageFolder& folder, const ImageSeries& series) {
  const SlicePlane& plane = series.plane();
  const SliceImages& clearest = series.clearest();
  Json directions = Json::array();
  for (const TagWave& tag : clearest.tags)
    directions.push_back(direction_json(clearest.plane, tag));
  Json json = {{"kind", describe(series.kind)},
               {"reason", series.reason},
               {"number", series.number},
               {"vendor", series.vendor},
               {"slices", series.slices.size()},
               {"phases", series.phases.times_ms.size()},
               {"trigger_times_ms", series.phases.times_ms},
               {"directions", directions},
               {"spacing_mm", {plane.row_spacing_mm, plane.column_spacing_mm}},
               {"matrix", {plane.rows, plane.columns}},
               {"thickness_mm", plane.thickness_mm},
               {"orientation", view_in_words(folder, series)},
               {"files", series.files.size()}};
  if (series.interval_ms) json["interval_ms"] = *series.interval_ms;
  if (series.velocity)
    json["velocity"] = {{"venc_cm_s", series.velocity->venc_cm_s}, {"source", series.velocity->source}};
  if (!series.b_s_mm2.empty()) json["b_s_mm2"] = series.b_s_mm2;
  return json;
}

void print_series(const ImageFolder& folder, const ImageSeries& series) {
  const SlicePlane& plane = series.plane();
  fmt::print("Series {}: {}, {}\n", series.number, describe(series.kind), view_in_words(folder, series));
  fmt::print("  because {}\n", series.reason);
  fmt::print("  {} slices, {} phases, {} x {} pixels of {:.4g} x {:.4g} mm, {} files\n", series.slices.size(),
             series.phases.times_ms.size(), plane.rows, plane.columns, plane.row_spacing_mm,
             plane.column_spacing_mm, series.files.size());
  if (series.phases.times_ms.size() > 1)
    fmt::print("  trigger times {:.0f} to {:.0f} ms\n", series.phases.times_ms.front(),
               series.phases.times_ms.back());
  for (const TagWave& tag : series.clearest().tags) {
    const Eigen::Vector3d normal = tag_normal(series.plane(), tag);
    fmt::print("  tags every {:.2f} mm, normal ({:.3f}, {:.3f}, {:.3f})\n", tag.spacing_mm(), normal.x(),
               normal.y(), normal.z());
  }
  if (!series.b_s_mm2.empty())
    fmt::print("  b values {:.0f} to {:.0f} s/mm\u00b2\n", series.b_s_mm2.front(), series.b_s_mm2.back());
}

ExitCode run_images(const ImagesArguments& arguments, const CommandOutput& out) {
  if (arguments.skeleton)
    require_output({*arguments.skeleton, {}, {}, arguments.force});  // a person has completed it
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  const ImageFolder folder = read_image_folder(arguments.folder, [&](size_t done, size_t all) {
    if (shows_progress) fmt::print(stderr, "\r{} of {} files{}", done, all, done == all ? "\n" : "");
  });
  if (out.json) {
    Json json = {{"folder", arguments.folder.string()},
                 {"files", folder.files.size()},
                 {"images", folder.images.size()}};
    json["series"] = Json::array();
    for (const ImageSeries& series : folder.series)
      json["series"].push_back(series_json(folder, series));
    json["problems"] = written(folder.problems);
    std::cout << json_text(json, 1) << '\n';
  } else {
    for (const ImageSeries& series : folder.series)
      print_series(folder, series);
    print_findings(folder.problems, stdout);
  }
  std::cout.flush();
  require_sound(folder);
  if (arguments.skeleton) {
    write_whole_file(*arguments.skeleton, study_skeleton(folder, *arguments.skeleton));
    if (!out.json) fmt::print("The study to complete is in {}\n", arguments.skeleton->string());
  }
  return ExitCode::done;
}

}  // namespace

void add_images(CommandLine& line) {
  auto arguments = std::make_shared<ImagesArguments>();
  CLI::App* command = line.add(
      "images", "what a scanner's export holds: series, their kind, slices, phases, tags, and what is odd",
      "  diastole images dicom/\n"
      "  diastole images dicom/ --json\n"
      "  diastole images dicom/ -o gel.study.toml\n"
      "docs/imaging.md says how kinds are told apart.");
  command
      ->add_option("FOLDER", arguments->folder, "the folder with the scanner's files, in any order and depth")
      ->required();
  command->add_option("-o,--output", arguments->skeleton,
                      "a study file with what the images tell, to complete");
  command->add_flag("--force", arguments->force, "replace a study that is there");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_images(*arguments, out); });
}

}  // namespace diastole
