#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/shape/drive_file.hpp"
#include "tools/diastole/shape/shape_options.hpp"
#include "tools/diastole/shape/shaper.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using shaping::Shaper;
using shaping::Shaping;

constexpr std::string_view drive_mark = "diastole shape";

struct ShapeOptions {
  shaping::ShapeRequest request;
  std::vector<fs::path> runs;
  fs::path drive, page;
  bool force = false;
};

fs::path experiment_beside(const fs::path& drive) {
  return fs::path(drive).replace_extension(".experiment.toml");
}

ExitCode shape(const ShapeOptions& options, const CommandOutput& out) {
  std::vector<fs::path> inputs{options.request.wanted.file, options.request.study};
  inputs.insert(inputs.end(), options.runs.begin(), options.runs.end());
  const fs::path experiment = experiment_beside(options.drive);
  RequiredOutputs outputs(inputs, options.force);
  outputs.add(options.drive, drive_mark);
  outputs.add(experiment, drive_mark);
  if (!options.page.empty()) outputs.add(options.page, report::page_mark);
  fmt::print(stderr, "Solving the specimen and inverting the rig's model.\n");
  const Shaper shaper(options.request);
  const Shaping shaping = shaper.after(options.runs);
  require_playable(shaping);
  const bool changed = shaping.lesson.ending == shaping::Ending::changed;
  if (!changed) {
    fs::remove(experiment);  // which would play other points
    write_whole_file(options.drive, points_text(shaping.cycle, shaper.target()));
    write_whole_file(experiment,
                     experiment_text(shaping.cycle, shaper.plan(), options.drive.filename().string()));
  }
  if (!options.page.empty())
    write_whole_file(options.page, shaping_page(shaping, shaper.wanted_mL(), shaper.target()));
  const bool is_followed = !changed && shaper.is_within_tolerance(shaping.drive);
  if (out.json) {
    shaping::Json document = shaping_json(shaping);
    document["tolerance"] = shaper.tolerance();
    document["level_tolerance_mL"] = shaper.level_tolerance_mL(shaping.drive);
    document["followed"] = is_followed;
    document["drive"] = changed ? shaping::Json() : shaping::Json(options.drive.string());
    document["experiment"] = changed ? shaping::Json() : shaping::Json(experiment.string());
    document["page"] = options.page.empty() ? shaping::Json() : shaping::Json(options.page.string());
    std::cout << json_text(document, 2) << '\n';
  } else {
    fmt::print("{}", shaping_words(shaping));
    if (changed) fmt::print("No drive was written: find what has changed first.\n");
    if (!changed) fmt::print("{} and {}\n", options.drive.string(), experiment.string());
  }
  if (!changed && !is_followed) fmt::print(stderr, "{}", shaper.miss_in_words("this drive", shaping.drive));
  return is_followed ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_shape(CommandLine& line) {
  auto options = std::make_shared<ShapeOptions>();
  CLI::App* command = line.add(
      "shape", "the drive by which the specimen's volume follows a wanted curve, and learning from runs",
      "  diastole shape examples/shape/ventricle.csv --study explained.study.toml -o drive.csv --page "
      "drive.html\n"
      "      by the rig's model alone; drive.experiment.toml beside it plays it\n"
      "  diastole shape ventricle.csv --study explained.study.toml -o drive2.csv --after first.run.h5\n"
      "      corrected by what the specimen did: gated volumes if the run has them (diastole flow --run), "
      "else its\n"
      "      pressure through the study's specimen\n"
      "  diastole shape ventricle.csv --study explained.study.toml -o drive3.csv --after first.run.h5 "
      "second.run.h5\n"
      "      all runs so far, in their order: the best is kept\n"
      "`diastole run --shape` does it live. Exit code 1: with this drive, the nearest that the pump can do,\n"
      "the specimen misses the curve, or its level, by more than --tolerance-percent of the range; or the\n"
      "specimen or the rig has changed, and no drive is written.");
  command
      ->add_option("TARGET", options->request.wanted.file,
                   "wanted curve: time_s or phase, volume_mL, pressure_kPa or fraction")
      ->required();
  shaping::add_request_to(*command, options->request);
  command->get_option("--study")->required();
  command
      ->add_option("-o,--output", options->drive,
                   "points of the drive to write; the experiment goes beside them")
      ->required();
  command->add_option("--after", options->runs, "runs of earlier drives, in their order");
  command->add_option("--page", options->page, "HTML page with plots to write");
  command->add_flag("--force", options->force, "replace output files that are no earlier result");
  line.on_run(command, [options](const CommandOutput& out) { return shape(*options, out); });
}

}  // namespace diastole
