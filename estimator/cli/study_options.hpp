#pragma once
// What commands on a study have in common: other parameter values, another mesh, time and progress.

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/finding.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

struct StudyOptions {
  std::filesystem::path study;
  std::vector<std::string> starts;
  std::string mesh;
  std::string refine;
  bool unload = false;
};

/// These add STUDY and --mesh; --set; --refine; --unload. `options` must live until the command has run.
void add_study(CLI::App& command, StudyOptions& options);
void add_values(CLI::App& command, StudyOptions& options);
void add_refinement(CLI::App& command, StudyOptions& options);

void add_unloading(CLI::App& command, StudyOptions& options);

/// The study with its replaced values. Throws InputError.
Study read_study(const StudyOptions& options);

/// The study's model (make_affected_model). Prints on standard error, and keeps, what is doubtful about it; prints it also if no model can
/// be made, for which it may be the reason.
ElasticModel make_model_and_print_findings(const Study& study, SolveOptions options,
                                           std::vector<Finding>& findings);

/// Asks on standard error, in the name of a command, whether a body so small or so large is meant to be in millimetres.
void remark_on_size(const HermiteMesh& mesh, std::string_view command);

using Clock = std::chrono::steady_clock;
inline double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

/// States on standard error, in the name of a command, that a shape that was imaged under load is taken as free of it.
void remark_on_imaged_load(const Study& study, std::string_view command);

/// A line on standard error for Newton's iterations, one a second at most, once the work has lasted longer than people like
/// to wait. `command` begins the line.
SolveOptions with_progress(std::string_view command);

}  // namespace diastole
