#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/study_images.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/reconstruction/reconstruction_record.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::array output_kinds{vtkhdf_kind,
                                  OutputKind{".csv", "frame,X_mm,Y_mm,Z_mm,x_mm,y_mm,z_mm,sigma_mm"},
                                  OutputKind{".json", reconstruction_file_mark}};
constexpr double silent_s = 2.0;

struct ReconstructArguments {
  StudyOptions study;
  OutputFiles outputs;
  std::optional<double> lambda;
  std::vector<double> smoothing;
  std::optional<size_t> points;
  bool plain = false;
  bool skip_stiffness = false;
};

ReconstructionOptions options_of(const ReconstructArguments& arguments) {
  ReconstructionOptions options;
  options.lambda = arguments.lambda;
  options.robust = !arguments.plain;
  options.points_a_frame = arguments.points;
  options.check_stiffness = !arguments.skip_stiffness;
  if (!arguments.smoothing.empty()) {
    options.smoothing.first = arguments.smoothing[0];
    options.smoothing.second = arguments.smoothing[1];
    if (options.smoothing.first + options.smoothing.second <= 0) {
      throw InputError(
          {"", "--smoothing", "both weights are 0", "Give at least one weight above 0, as 0.02,1."});
    }
  }
  options.on_frame = [begun = Clock::now()](size_t done, size_t of) {
    const double elapsed_s = seconds_since(begun);
    if (elapsed_s > silent_s)
      fmt::print(stderr, "reconstruct: {} of {} frames, {:.0f} s\n", done, of, elapsed_s);
  };
  return options;
}

void write_outputs(const std::vector<std::filesystem::path>& files, const StudyReconstruction& reconstruction,
                   const ReconstructionRecord& record) {
  for (const std::filesystem::path& file : files) {
    if (file.extension() == ".csv") write_whole_file(file, points_csv(reconstruction.samples));
    if (file.extension() == ".vtkhdf") write_vtkhdf(file, reconstruction_grid(reconstruction));
    if (file.extension() == ".json") write_whole_file(file, to_json(record));
  }
}

void print_record(const ReconstructionRecord& record) {
  fmt::print(
      "  frame  pressure (kPa)   numbers   left out  chi2/dof  freedoms  largest (mm)  error (mm)   volume "
      "(%)\n");
  for (const ReconstructedFrame& frame : record.frames) {
    fmt::print(
        "  {:>5}  {:14.3f}  {:>8}  {:>9}  {:8.3f}  {:8.0f}  {:12.3f}  {:10.3f}   {:+.2f} \u00b1 {:.2f}\n",
        frame.frame, frame.pressure_kPa, frame.rows, frame.wild + frame.not_found, frame.chi2_per_dof,
        frame.degrees_of_freedom, frame.largest_displacement_mm, frame.mean_se_mm,
        100 * (frame.volume_ratio - 1), 100 * frame.volume_ratio_se);
  }
  const auto worst = std::max_element(record.elements.begin(), record.elements.end(),
                                      [](const auto& a, const auto& b) { return a.se_mm < b.se_mm; });
  fmt::print("\nThe {} alone see {:.0f} of the field's {} modes; smoothness fills in the others.\n",
             record.data, record.modes_seen, record.unknowns);
  fmt::print("Least is known of element {}: {} numbers, \u00b1 {:.3f} mm.\n\n", worst->element, worst->rows,
             worst->se_mm);
  if (record.findings.empty()) fmt::print("Nothing is wrong with the data.\n");
}

ExitCode run_reconstruct(const ReconstructArguments& arguments, const CommandOutput& out) {
  Study study = read_study(arguments.study);
  use_images(study);
  arguments.outputs.require(
      inputs_of(study), output_kinds, "is no kind of file that a reconstruction is written to",
      "End it in .csv (points for `diastole fit`), .vtkhdf (for ParaView) or .json (for `diastole report`).");
  const ReconstructionOptions options = options_of(arguments);
  const Measurement measurement = read_measurement(study);
  const StudyReconstruction reconstruction = reconstruct_study(study, measurement, options);
  const ReconstructionRecord record = reconstruction_record(study, measurement, options, reconstruction);
  const bool sound = !has_error(record.findings);
  if (!reconstruction.fields.empty()) write_outputs(arguments.outputs.files, reconstruction, record);
  if (out.json) {
    print_findings(record.findings, stderr);
    std::cout << to_json(record, false);
  } else {
    if (!record.frames.empty()) print_record(record);
    print_findings(record.findings, stdout);
    if (record.frames.empty()) {
      fmt::print("Nothing was reconstructed: the data cannot be what they say.\n");
    } else {
      for (const std::filesystem::path& file : arguments.outputs.files)
        fmt::print("Written: {}\n", file.string());
    }
  }
  return sound ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_reconstruct(CommandLine& line) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* command = line.add(
      "reconstruct",
      "the displacement field that tag points show, its errors, and what is wrong with the data",
      "  diastole reconstruct examples/phantom-a.study.toml\n"
      "  diastole reconstruct examples/phantom-a.study.toml -o gel.points.csv -o gel.vtkhdf -o gel.json\n"
      "  diastole report gel.json -o quality.html\n"
      "Each tag point counts along the one direction that it knows, by its sigma_mm (Eq. 2 of the paper). "
      "How smooth the\n"
      "field must be is found by generalised cross-validation; points beyond five times the spread of the "
      "others are left\n"
      "out. The .csv is what `diastole fit` reads as `points`: the paper's way. docs/reconstruction.md says "
      "what the numbers\n"
      "mean and lists what is looked for in the data.\n"
      "Exit code 1: the data cannot be what they say (another unit, frames that disagree); the message says "
      "which.");
  add_study(*command, arguments->study);
  arguments->outputs.add_options(
      *command, "a .csv of points for `diastole fit`, a .vtkhdf for ParaView, or a .json for the report");
  command
      ->add_option("--points", arguments->points,
                   "points a frame in the .csv [as many as the field has freedoms / 3]")
      ->check(number_between(1, 1'000'000));
  command->add_option("--lambda", arguments->lambda, "smoothing weight, instead of cross-validation")
      ->check(number_between(1e-6, 1e12));
  command
      ->add_option("--smoothing", arguments->smoothing,
                   "weights of first and second derivatives in the smoothness, as 0.02,1")
      ->delimiter(',')
      ->expected(2)
      ->check(number_between(0.0, 1e6));
  command->add_flag("--keep-wild", arguments->plain, "plain least squares: leave no wild point out");
  command->add_flag("--no-stiffness", arguments->skip_stiffness,
                    "skip the forward model that tests the pressures' unit");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_reconstruct(*arguments, out); });
}

}  // namespace diastole
