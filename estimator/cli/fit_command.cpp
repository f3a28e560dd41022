#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/interruption.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/study_images.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/cli/unloading_output.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/io/study_fingerprint.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/unloaded_model.hpp"
#include "estimator/reconstruction/study_reconstruction.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

struct FitArguments {
  StudyOptions study;
  std::string smooth;
  std::string robust = "auto";
  double pressure_offset_kPa = 0;
  double fibre_sigma_deg = 0, geometry_sigma_mm = 0;
  bool finer_mesh = false;
  std::optional<std::filesystem::path> energy;
  bool profile = false;
  int posterior_draws = 0;
  std::filesystem::path start;
  std::optional<std::filesystem::path> checkpoint;
  bool resume = false;
  std::optional<std::filesystem::path> output;
  bool force = false;
  bool unexamined = false;
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
    fmt::print("{} = {:.3f}{}, {}: no error can be given\n", what, parameter.value, unit,
               parameter.at_bound.empty() ? "which the data do not see"
                                          : fmt::format("on its {} bound", parameter.at_bound));
  }
  if (parameter.elements.empty()) return;
  fmt::print("  element   value{}   standard error\n", unit);
  for (size_t i = 0; i < parameter.elements.size(); ++i) {
    const FittedElement& element = parameter.elements[i];
    fmt::print("  {:>7}  {:9.3f}  {:>15}\n", i, element.value,
               std::isnan(element.se) ? "on its bound" : fmt::format("{:.3f}", element.se));
  }
}

void print_shapes(const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters) {
    if (const auto& profile = parameter.profile) {
      fmt::print("{}: profile interval {:.4g} to {:.4g} (95 %){}\n", parameter.name, profile->ci95[0],
                 profile->ci95[1], profile->at_bound[0] || profile->at_bound[1] ? ", ended by a bound" : "");
    }
    if (const auto& posterior = parameter.posterior) {
      fmt::print("{}: posterior {:.4g} ± {:.2g}, 95 % within {:.4g} to {:.4g}\n", parameter.name,
                 posterior->mean, posterior->sd, posterior->ci95[0], posterior->ci95[1]);
    }
  }
}

/// Of whole parameters, where the errors of fibres or walls were stated.
void print_shares(const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters) {
    const auto& shares = parameter.variance_shares;
    if (!shares || (shares->fibres == 0 && shares->geometry == 0)) continue;
    fmt::print(
        "{}: variance {:.0f} % from the images, {:.0f} % pressures, {:.0f} % fibres, {:.0f} % geometry\n",
        parameter.name, 100 * shares->images, 100 * shares->pressures, 100 * shares->fibres,
        100 * shares->geometry);
  }
}

void print_record(const FitRecord& record) {
  if (record.parameters.empty()) return;  // the search did not even begin: its reason says why
  for (const FittedParameter& parameter : record.parameters)
    print_parameter(parameter);
  print_shares(record);
  print_shapes(record);
  fmt::print("\nResiduals {:.3f} mm RMS over {} residuals of the {}; chi2/dof {:.3f}\n\n", record.rms_mm,
             record.residuals_used, record.data, record.chi2_per_dof);
  fmt::print("  frame  measured (kPa)  estimated (kPa)    points  RMS (mm)\n");
  for (const FittedFrame& frame : record.frames) {
    fmt::print("  {:>5}  {:14.4f}  {:7.4f} \u00b1 {:.4f}  {:>8}  {:8.3f}\n", frame.frame, frame.measured_kPa,
               frame.estimated_kPa, frame.se_kPa, frame.points, frame.rms_mm);
  }
  fmt::print("\n");
  if (record.unloaded) fmt::print("{}\n", unloading_sentence(*record.unloaded));
  if (record.energy)
    fmt::print(
        "Up to frame {} the pressure did a work of {:.3f} \u00b1 {:.3f} mJ; the wall has stored {:.3f} mJ.\n",
        record.energy->frame, record.energy->work_mJ, record.energy->sigma_mJ, record.energy->stored_mJ);
  for (const std::string& remark : record.remarks)
    fmt::print("{}\n", remark);
  for (const Exclusion& exclusion : record.excluded)
    fmt::print("{} not used: {}.\n", exclusion.points, exclusion.reason);
}

/// A checkpoint is taken up only by the fit that left it; --start takes any result with the same parameters.
void require_own_checkpoint(const FitRecord& checkpoint, const Study& study, const std::string& file) {
  const bool own = checkpoint.fingerprint == study_fingerprint(study);
  if (own) return;
  throw InputError(
      {file, "--resume",
       fmt::format("is of another fit, or its study or data have changed since: {} on {} elements",
                   checkpoint.study, fmt::join(checkpoint.mesh, "x")),
       "Give another --checkpoint, or take its values up with --start."});
}

std::optional<FitRecord> start_of(const FitArguments& arguments, const Study& study) {
  std::filesystem::path file = arguments.start;
  if (arguments.resume) {
    if (!arguments.checkpoint) {
      throw InputError({"", "--resume", "needs the checkpoint to go on from", "Give --checkpoint FILE too."});
    }
    if (!std::filesystem::exists(*arguments.checkpoint)) {
      fmt::print(stderr, "There is no {} yet: starting from the study's values.\n",
                 arguments.checkpoint->string());
      return {};
    }
    file = *arguments.checkpoint;
  }
  if (file.empty()) return {};
  FitRecord record = fit_record_from_json(read_whole_file(file), file.string());
  if (arguments.resume) require_own_checkpoint(record, study, file.string());
  fmt::print(stderr, "Starting from {}.\n", file.string());
  return record;
}

std::vector<Finding> examined(const FitArguments& arguments, const Study& study,
                              const Measurement& measurement) {
  if (arguments.unexamined) return {};
  fmt::print(stderr, "Examining the data; --unexamined skips that.\n");
  return examine_measurement(study, measurement);
}

ExitCode refuse_data(const FitRecord& record, const CommandOutput& out) {
  print_findings(record.findings, out.json ? stderr : stdout);
  fmt::print(stderr, "{} `diastole reconstruct` shows them; --unexamined fits them nevertheless.\n",
             record.reason);
  if (out.json) std::cout << to_json(record);
  return ExitCode::negative;
}

/// Whether a whole parameter rests on its bound: the search has converged, but to no estimate.
bool ended_on_bound(const FitRecord& record) {
  return std::any_of(record.parameters.begin(), record.parameters.end(),
                     [](const FittedParameter& parameter) {
                       return parameter.elements.empty() && !parameter.at_bound.empty();
                     });
}

/// All but what the data and the command's files give. `study` outlives it.
StudyFitOptions options_of(const FitArguments& arguments, const Study& study) {
  StudyFitOptions options;
  options.iteration_limit = arguments.iteration_limit;
  options.robustness = arguments.robust == "yes"  ? Robustness::always
                       : arguments.robust == "no" ? Robustness::never
                                                  : Robustness::if_needed;
  options.on_iteration = [&study](const FitIteration& step) {
    std::string values;
    for (size_t i = 0; i < step.parameters.size(); ++i) {
      values += fmt::format("  {} {:.5g}", study.law.parameters[i].name, step.parameters[i]);
    }
    const std::string cost = step.cost < 1e300 ? fmt::format("{:.4f}", step.cost) : "none";
    fmt::print(stderr, "  iteration {:>2}  cost {}{}{}\n", step.iteration, cost, values,
               step.accepted ? "" : "  (step refused)");
  };
  options.unload = arguments.study.unload;
  options.fibre_sigma_deg = arguments.fibre_sigma_deg;
  options.geometry_sigma_mm = arguments.geometry_sigma_mm;
  options.finer_mesh = arguments.finer_mesh;
  options.start = start_of(arguments, study);
  options.profile = arguments.profile;
  if (arguments.pressure_offset_kPa > 0) options.pressure_offset_sigma_kPa = arguments.pressure_offset_kPa;
  if (arguments.posterior_draws > 0) {
    options.posterior.emplace();
    options.posterior->steps =
        (arguments.posterior_draws + options.posterior->chains - 1) / options.posterior->chains;
    options.posterior->warm_up = std::clamp(options.posterior->steps / 4, 10, 60);
    options.posterior->on_step = [](int done, int all) {
      if (done % 50 == 0 || done == all) fmt::print(stderr, "  posterior: {} of {} steps\n", done, all);
    };
  }
  options.interrupted = [] { return Interruption::requested(); };
  return options;
}

void print_result(const FitRecord& record, const FitArguments& arguments, const CommandOutput& out) {
  if (Interruption::requested() && !record.converged) {
    const bool kept = arguments.checkpoint && std::filesystem::exists(*arguments.checkpoint);
    fmt::print(stderr, "{}\n",
               kept ? fmt::format("Go on with the same command and --resume: {} holds what was reached.",
                                  arguments.checkpoint->string())
                    : "With --checkpoint FILE a search can go on from where it was ended.");
  }
  if (out.json) {
    print_findings(record.findings, stderr);
    std::cout << to_json(record);
  } else {
    print_findings(record.findings, stdout);
    print_record(record);
    if (arguments.output) fmt::print("\nThe result is in {}\n", arguments.output->string());
  }
}

ExitCode run_fit(const FitArguments& arguments, const CommandOutput& out) {
  Study study = read_study(arguments.study);
  // What is wrong with the command's files is reported before images are tracked and data examined.
  if (arguments.output && arguments.output == arguments.checkpoint) {
    throw InputError({arguments.output->string(), "--checkpoint", "is the file of the result too",
                      "Give the checkpoint a file of its own."});
  }
  if (arguments.output) {
    require_output({*arguments.output, inputs_of(study), fit_file_mark, arguments.force});
  }
  std::optional<WorkLoop> loop;
  if (arguments.energy) loop = read_work_loop(*arguments.energy);
  const std::optional<std::filesystem::path> tracked = use_images(study);
  if (arguments.output)  // nor may it be the tags of these images
    require_output({*arguments.output, inputs_of(study), fit_file_mark, arguments.force});
  if (!arguments.smooth.empty()) set_smoothness(study, arguments.smooth);
  if (arguments.study.unload) {
    (void)imaged_load_of(study);
  } else {
    remark_on_imaged_load(study, "fit");
  }
  const Measurement measurement = read_measurement(study);
  StudyFitOptions options = options_of(arguments, study);
  if (loop) options.work = measured_work(*loop, measurement, *arguments.energy);
  fmt::print(stderr, "Fitting {} in {} frames.\n",
             measurement.tags.empty() ? fmt::format("{} 3-D points", measurement.points.size())
                                      : fmt::format("{} tag points", measurement.tags.size()),
             measurement.frames.size());
  std::vector<Finding> findings = examined(arguments, study, measurement);
  std::ranges::copy(model_findings(study), std::back_inserter(findings));
  if (has_error(findings)) return refuse_data(refused_fit(study, measurement, std::move(findings)), out);
  if (arguments.checkpoint) {
    require_output({*arguments.checkpoint, inputs_of(study), fit_file_mark, arguments.force});
    options.on_checkpoint = [&](const FitRecord& reached) { write_fit_file(reached, *arguments.checkpoint); };
  }
  const Interruption interruption;
  FitRecord record = fit_study(study, measurement, options);
  record.findings = std::move(findings);
  if (tracked) record.images = std::filesystem::weakly_canonical(*tracked).string();
  fmt::print(stderr, "{} {} iterations, {} equilibrium solutions, {:.1f} s.\n", record.reason,
             record.iterations, record.forward_solves, record.seconds);
  if (arguments.output) write_fit_file(record, *arguments.output);
  print_result(record, arguments, out);
  const bool returned = !arguments.study.unload || (record.unloaded && record.unloaded->returned);
  return record.converged && !ended_on_bound(record) && returned ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_fit(CommandLine& line) {
  auto arguments = std::make_shared<FitArguments>();
  CLI::App* command = line.add(
      "fit", "estimate the material parameters from imaged motion and pressure",
      "  diastole fit examples/phantom-a.study.toml\n"
      "  diastole fit examples/phantom-a.study.toml -o fit.json\n"
      "  diastole fit examples/phantom-a.study.toml --set C1_kPa=12 --mesh 8,8,2 --json\n"
      "  diastole fit heart.study.toml --unload\n"
      "  diastole fit heart.study.toml --energy heart.loop.csv\n"
      "Exit code 1: the data cannot be what they say, the search did not converge, a parameter ended on its\n"
      "bound, which is no estimate, or with --unload the load does not bring the image back.");
  add_study(*command, arguments->study);
  add_values(*command, arguments->study);
  add_unloading(*command, arguments->study);
  command->add_option("--smooth", arguments->smooth,
                      "how alike neighbouring elements are, for values that vary by element: evidence (the "
                      "data say it; default), none, or the usual relative difference, as 0.05");
  command
      ->add_option("--robust", arguments->robust,
                   "give wild points no weight (Student's t): yes, no, or auto, when there are more than "
                   "chance explains")
      ->check(CLI::IsMember({"yes", "no", "auto"}))
      ->capture_default_str();
  command
      ->add_option(
          "--pressure-offset", arguments->pressure_offset_kPa,
          "seek a common offset of all frame pressures too, about zero with this standard deviation, kPa")
      ->check(positive_number);
  command
      ->add_option("--fibre-sigma-deg", arguments->fibre_sigma_deg,
                   "fibres may be off by a common angle of this standard deviation: the errors then hold it")
      ->check(number_between(0.0, 45.0));
  command
      ->add_option("--geometry-sigma-mm", arguments->geometry_sigma_mm,
                   "the walls may lie off their places by as much: likewise")
      ->check(number_between(0.0, 10.0));
  command->add_flag(
      "--finer-mesh", arguments->finer_mesh,
      "correct the motion by what twice as many elements each way change at the estimate, and fit "
      "again: the finer mesh's values for one solution on it (docs/estimation.md)");
  command->add_option(
      "--energy", arguments->energy,
      "the work that the pressure has done is what the wall stores: a loop of pressure against volume from "
      "`diastole flow --loop`, as one more equation (docs/heart.md)");
  command->add_flag("--unexamined", arguments->unexamined,
                    "do not look beforehand for what is wrong with the data (docs/reconstruction.md), and "
                    "fit data that cannot be what they say");
  command->add_flag("--profile", arguments->profile, "95 % intervals from the likelihood's true shape too");
  command
      ->add_option("--posterior", arguments->posterior_draws,
                   "draw the posterior so often, from the full model: some seconds to minutes a hundred")
      ->check(number_between(40, 1000000));
  command->add_option("--start", arguments->start, "start from an earlier result or checkpoint");
  command->add_option("--checkpoint", arguments->checkpoint, "keep what each step reached in this file");
  command->add_flag("--resume", arguments->resume, "go on from the checkpoint, if there is one")
      ->excludes("--start");
  command->add_option("-o,--output", arguments->output,
                      "keep the result in this file, for `diastole report`");
  command->add_flag("--force", arguments->force, "replace an output file that is no fit result");
  command->add_option("--iterations", arguments->iteration_limit, "stop after so many steps")
      ->check(number_between(1, 1000))
      ->capture_default_str();
  line.on_run(command, [arguments](const CommandOutput& out) { return run_fit(*arguments, out); });
}

}  // namespace diastole
