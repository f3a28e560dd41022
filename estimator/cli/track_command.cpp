#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/page_and_record.hpp"
#include "estimator/imaging/tracking/specimen_pose.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/imaging/tracking/tracking_record.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/report.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

struct TrackArguments {
  std::filesystem::path folder;
  std::filesystem::path output;
  std::optional<std::filesystem::path> pose;
  std::string coordinates = "auto";
  std::optional<std::filesystem::path> edits;
  std::optional<std::filesystem::path> page;
  std::optional<std::filesystem::path> record;
  bool force = false;
};

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json pose_json(const imaging::SpecimenPose& pose) {
  return {{"origin_mm", vector_json(pose.origin_mm)},
          {"x_axis", vector_json(pose.axes.col(0))},
          {"y_axis", vector_json(pose.axes.col(1))},
          {"z_axis", vector_json(pose.axes.col(2))},
          {"source", pose.source}};
}

Json slice_json(const imaging::TrackedSlice& slice) {
  Json json = {
      {"name", slice.view.name}, {"points", slice.points.points.size()}, {"dropped", slice.points.dropped}};
  json["directions"] = Json::array();
  for (const imaging::TagWave& wave : slice.tracked.waves)
    json["directions"].push_back({{"normal", vector_json(imaging::tag_normal(slice.view.plane, wave))},
                                  {"spacing_mm", wave.spacing_mm()}});
  json["noise_factor"] = slice.tracked.noise_factor;
  json["phases"] = Json::array();
  for (const imaging::PhaseSummary& phase : imaging::phase_summaries(slice))
    json["phases"].push_back({{"frame", phase.frame},
                              {"trigger_ms", phase.trigger_ms},
                              {"points", phase.points},
                              {"rms_px", phase.sigma_px},
                              {"residual", phase.residual}});
  return json;
}

ExitCode run_track(const TrackArguments& arguments, const CommandOutput& out) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::filesystem::path> inputs;
  if (arguments.pose) inputs.push_back(*arguments.pose);
  const imaging::TrackRequest request{.folder = arguments.folder,
                                      .pose = arguments.pose,
                                      .coordinates = arguments.coordinates,
                                      .edits = arguments.edits};
  inputs.push_back(imaging::edits_file(request));
  RequiredOutputs outputs(inputs, arguments.force);
  outputs.add(arguments.output, imaging::tags_file_mark);
  outputs.add(arguments.page, report::page_mark);
  outputs.add(arguments.record, tracking_file_mark);
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  const imaging::TrackedFolder tracked = imaging::track_folder(request, [&](const std::string& stage) {
    if (shows_progress) fmt::print(stderr, "{}\n", stage);
  });
  write_whole_file(arguments.output, imaging::tags_file_text(tracked.points));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  write_page_and_record(arguments.page, arguments.record,
                        [&] { return imaging::tracking_record(tracked, seconds); });
  if (out.json) {
    Json json = {{"points", tracked.points.size()},
                 {"dropped", tracked.dropped},
                 {"rms_px", tracked.rms_px},
                 {"coordinates", tracked.pose ? "specimen" : "patient"},
                 {"seconds", seconds},
                 {"problems", written(tracked.problems)}};
    if (tracked.edits)
      json["edits"] = {{"file", tracked.edits->file.string()},
                       {"applied", tracked.edits->counts},
                       {"undone", tracked.edits->undone}};
    if (tracked.pose) json["to_specimen"] = pose_json(*tracked.pose);
    if (tracked.outline)
      json["outline"] = {{"inner_radius_mm", tracked.outline->inner_radius_mm},
                         {"outer_radius_mm", tracked.outline->outer_radius_mm},
                         {"height_mm", tracked.outline->height_mm}};
    json["slices"] = Json::array();
    for (const imaging::TrackedSlice& slice : tracked.slices)
      json["slices"].push_back(slice_json(slice));
    std::cout << json_text(json, 1) << '\n';
    return ExitCode::done;
  }
  for (const imaging::TrackedSlice& slice : tracked.slices)
    fmt::print("{}: {} points\n", slice.view.name, slice.points.points.size());
  fmt::print("\n{} tag points, standard errors {:.3f} px RMS, in {:.1f} s\n", tracked.points.size(),
             tracked.rms_px, seconds);
  for (const auto& [reason, count] : tracked.dropped)
    fmt::print("{} dropped: {}\n", count, reason);
  if (tracked.edits) {
    for (const auto& [action, count] : tracked.edits->counts)
      fmt::print("By hand: {} of action {}, from {}\n", count, action, tracked.edits->file.string());
  }
  if (tracked.outline)
    fmt::print("Outlines: inner radius {:.1f} mm, outer {:.1f} mm, height {:.1f} mm\n",
               tracked.outline->inner_radius_mm, tracked.outline->outer_radius_mm,
               tracked.outline->height_mm);
  print_findings(tracked.problems, stdout);
  fmt::print("In {} coordinates{}: {}\n", tracked.pose ? "the specimen's" : "patient",
             tracked.pose ? fmt::format(" ({})", tracked.pose->source) : "", arguments.output.string());
  if (arguments.page) fmt::print("The page to look at: {}\n", arguments.page->string());
  return ExitCode::done;
}

}  // namespace

void add_track(CommandLine& line) {
  auto arguments = std::make_shared<TrackArguments>();
  CLI::App* command = line.add(
      "track", "tag lines followed through the cycle: points with errors, from a scanner's tagged cines",
      "  diastole track dicom/ -o gel.tags.csv\n"
      "  diastole track dicom/ -o gel.tags.csv --page gel.html\n"
      "  diastole track dicom/ -o heart.tags.csv --pose heart.pose.toml\n"
      "  diastole track dicom/ -o gel.tags.csv --coords patient --json\n"
      "What was put right by hand stands in FOLDER.edits.jsonl and is done again each time: `diastole desk "
      "FOLDER` "
      "writes it, or you.\n"
      "Coordinates are the specimen's if its pose is given, lies beside the folder (*.pose.toml), or is seen "
      "in the images (an annulus\n"
      "with its two ends); otherwise the scanner's. docs/imaging.md says more.");
  command->add_option("FOLDER", arguments->folder, "the folder with the scanner's files")->required();
  command->add_option("-o,--output", arguments->output, "the tag points to write (*.tags.csv)")->required();
  command->add_option("--pose", arguments->pose,
                      "where the specimen's frame lies in patient coordinates (*.pose.toml)");
  command->add_option("--coords", arguments->coordinates, "coordinates of the points")
      ->check(CLI::IsMember({"auto", "specimen", "patient"}))
      ->capture_default_str();
  command->add_option("--edits", arguments->edits,
                      "what was put right by hand (*.edits.jsonl) [FOLDER.edits.jsonl beside the folder]");
  command->add_option("--page", arguments->page,
                      "a page to look at: every slice's cine with its lines, what was left out, residuals");
  command->add_option("--record", arguments->record, "the same as a file for `diastole report` (*.json)");
  command->add_flag("--force", arguments->force, "replace output files that are none of track's");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_track(*arguments, out); });
}

}  // namespace diastole
