#include "estimator/cli/study_options.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <utility>

#include "estimator/cli/output_files.hpp"
#include "estimator/model/affected_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

void add_study(CLI::App& command, StudyOptions& options) {
  command.add_option("STUDY", options.study, "study file (*.study.toml)")->required();
  command.add_option("--mesh", options.mesh, "elements around, along, through the wall, as 8,8,4");
}

void add_values(CLI::App& command, StudyOptions& options) {
  command.add_option("--set", options.starts, "NAME=NUMBER: another parameter value; may be repeated")
      ->allow_extra_args(false);
}

void add_refinement(CLI::App& command, StudyOptions& options) {
  command.add_option("--refine", options.refine,
                     "how often to halve them around, along, through, keeping the body exactly, as 0,1,1");
}

void add_unloading(CLI::App& command, StudyOptions& options) {
  command.add_flag(
      "--unload", options.unload,
      "the study's shape was imaged under load (imaged_at_kPa): find the shape without it first");
}

void remark_on_imaged_load(const Study& study, std::string_view command) {
  if (!study.imaged_at) return;
  fmt::print(stderr,
             "diastole {}: the shape was imaged at {:g} kPa, and is taken as free of stress here; --unload "
             "of solve, fit, montecarlo, design and mesh export finds the one that is.\n",
             command, study.imaged_at->pressure_kPa);
}

Study read_study(const StudyOptions& options) {
  Study study = read_study(options.study);
  for (const std::string& start : options.starts)
    set_start(study, start);
  if (!options.mesh.empty()) set_mesh(study, options.mesh);
  if (!options.refine.empty()) set_refinement(study, options.refine);
  return study;
}

ElasticModel make_model_and_print_findings(const Study& study, SolveOptions options,
                                           std::vector<Finding>& findings) {
  const auto made = [&]() -> ElasticModel {
    try {
      return make_affected_model(study, std::move(options), &findings);
    } catch (const InputError&) {
      print_findings(findings, stderr);
      throw;
    }
  };
  ElasticModel model = made();
  print_findings(findings, stderr);
  return model;
}

void remark_on_size(const HermiteMesh& mesh, std::string_view command) {
  constexpr double least_mm = 2.0, most_mm = 1000.0;
  const double extent_mm = mesh.extent_mm();
  if (extent_mm >= least_mm && extent_mm <= most_mm) return;
  fmt::print(stderr, "diastole {}: the body reaches over {:.2g} mm; were its lengths meant in {}?\n", command,
             extent_mm, extent_mm < least_mm ? "metres" : "micrometres");
}

SolveOptions with_progress(std::string_view command) {
  constexpr double silent_s = 2.0, pause_s = 1.0;
  SolveOptions options;
  options.on_iteration = [begun = Clock::now(), next_s = silent_s, command](
                             double pressure_kPa, const NewtonIteration& iteration) mutable {
    const double elapsed_s = seconds_since(begun);
    if (elapsed_s < next_s) return;
    next_s = elapsed_s + pause_s;
    fmt::print(stderr, "{}: {:.3g} kPa, correction {:.1e}, {:.0f} s\n", command, pressure_kPa, iteration.step,
               elapsed_s);
  };
  return options;
}

}  // namespace diastole
