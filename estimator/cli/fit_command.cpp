#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

#include "estimator/cli/commands.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/io/whole_file.hpp"

namespace diastole {
namespace {

struct FitArguments {
  std::filesystem::path study;
  std::vector<std::string> starts;
  std::string mesh;
  std::string smooth;
  std::optional<std::filesystem::path> output;
  bool force = false;
  int iteration_limit = 50;
};

void print_parameter(const FittedParameter& parameter) {
  const size_t underscore = parameter.name.rfind('_');
  const std::string name = parameter.name.substr(0, underscore);
  const std::string unit = underscore == std::string::npos ? "" : " " + parameter.name.substr(underscore + 1);
  const std::string what = parameter.elements.empty() ? name : "The mean " + name;
  if (std::isfinite(parameter.se)) {
    fmt::print("{} = {:.3f} \u00b1 {:.3f}{} (95 % interval {:.3f} to {:.3f}{})\n", what, parameter.value,
               parameter.se, unit, parameter.ci95[0], parameter.ci95[1], unit);
  } else {
    fmt::print("{} = {:.3f}{}, on its {} bound: no error can be given\n", what, parameter.value, unit,
               parameter.at_bound);
  }
  if (parameter.elements.empty()) return;
  fmt::print("  element   value{}   standard error\n", unit);
  for (size_t i = 0; i < parameter.elements.size(); ++i) {
    const FittedElement& element = parameter.elements[i];
    fmt::print("  {:>7}  {:9.3f}  {:>15}\n", i, element.value,
               std::isnan(element.se) ? "on its bound" : fmt::format("{:.3f}", element.se));
  }
}

void print_record(const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters)
    print_parameter(parameter);
  fmt::print("\nResiduals {:.3f} mm RMS over {} residuals of the {}; chi2/dof {:.3f}\n\n", record.rms_mm,
             record.residuals_used, record.data, record.chi2_per_dof);
  fmt::print("  frame  measured (kPa)  estimated (kPa)    points  RMS (mm)\n");
  for (const FittedFrame& frame : record.frames) {
    fmt::print("  {:>5}  {:14.4f}  {:7.4f} \u00b1 {:.4f}  {:>8}  {:8.3f}\n", frame.frame, frame.measured_kPa,
               frame.estimated_kPa, frame.se_kPa, frame.points, frame.rms_mm);
  }
  fmt::print("\n");
  for (const std::string& remark : record.remarks)
    fmt::print("{}\n", remark);
  for (const Exclusion& exclusion : record.excluded)
    fmt::print("{} not used: {}.\n", exclusion.points, exclusion.reason);
}

ExitCode run_fit(const FitArguments& arguments, const CommandOutput& out) {
  Study study = read_study(arguments.study);
  if (!arguments.mesh.empty()) set_mesh(study, arguments.mesh);
  if (!arguments.smooth.empty()) set_smoothness(study, arguments.smooth);
  for (const std::string& start : arguments.starts)
    set_start(study, start);
  if (arguments.output) {
    require_output({*arguments.output, inputs_of(study), fit_file_mark, arguments.force});
  }
  const Measurement measurement = read_measurement(study);
  fmt::print(stderr, "Fitting {} in {} frames.\n",
             measurement.tags.empty() ? fmt::format("{} 3-D points", measurement.points.size())
                                      : fmt::format("{} tag points", measurement.tags.size()),
             measurement.frames.size());
  StudyFitOptions options;
  options.iteration_limit = arguments.iteration_limit;
  options.on_iteration = [&](const FitIteration& step) {
    std::string values;
    for (size_t i = 0; i < step.parameters.size(); ++i) {
      values += fmt::format("  {} {:.5g}", study.law.parameters[i].name, step.parameters[i]);
    }
    fmt::print(stderr, "  iteration {:>2}  cost {:.4f}{}{}\n", step.iteration, step.cost, values,
               step.accepted ? "" : "  (step refused)");
  };
  const FitRecord record = fit_study(study, measurement, options);
  fmt::print(stderr, "{} {} iterations, {} equilibrium solutions, {:.1f} s.\n", record.reason,
             record.iterations, record.forward_solves, record.seconds);
  if (arguments.output) write_fit_file(record, *arguments.output);
  if (out.json) {
    std::cout << to_json(record);
  } else {
    print_record(record);
    if (arguments.output) fmt::print("\nThe result is in {}\n", arguments.output->string());
  }
  return record.converged ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_fit(CommandLine& line) {
  auto arguments = std::make_shared<FitArguments>();
  CLI::App* command =
      line.add("fit", "estimate the material parameters from imaged motion and pressure",
               "  diastole fit examples/phantom-a.study.toml\n"
               "  diastole fit examples/phantom-a.study.toml -o fit.json\n"
               "  diastole fit examples/phantom-a.study.toml --set C1_kPa=12 --mesh 8,8,2 --json");
  command->add_option("STUDY", arguments->study, "study file")->required();
  command->add_option("--set", arguments->starts, "another start value, NAME=NUMBER (may be repeated)")
      ->allow_extra_args(false);
  command->add_option("--mesh", arguments->mesh,
                      "other element counts: circumferential,longitudinal,transmural");
  command->add_option("--smooth", arguments->smooth,
                      "how alike neighbouring elements are, for values that vary by element: evidence (the data say "
                      "it; default), none, or the usual relative difference, as 0.05");
  command->add_option("-o,--output", arguments->output,
                      "keep the result in this file, for `diastole report`");
  command->add_flag("--force", arguments->force, "replace an output file that is no fit result");
  command->add_option("--iterations", arguments->iteration_limit, "stop after so many steps")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  line.on_run(command, [arguments](const CommandOutput& out) { return run_fit(*arguments, out); });
}

}  // namespace diastole
