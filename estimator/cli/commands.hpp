#pragma once
// The estimator's subcommands.

#include <filesystem>
#include <functional>

#include "protocol/contract/command.hpp"

namespace diastole {

void add_images(CommandLine& line);
void add_track(CommandLine& line);
void add_flow(CommandLine& line);
void add_ventricle(CommandLine& line);
void add_fibres(CommandLine& line);
void add_solve(CommandLine& line);
void add_pressure_volume(CommandLine& line);
void add_fit(CommandLine& line);
void add_reconstruct(CommandLine& line);
void add_montecarlo(CommandLine& line);
void add_design(CommandLine& line);
void add_shear(CommandLine& line);
void add_law(CommandLine& line);
void add_report(CommandLine& line);
void add_mesh(CommandLine& line);
void add_effects(CommandLine& line);
void add_reference(CommandLine& line);
/// Compares the explanations in a folder with what was hidden and prints how often they are right.
using ExplanationScorer = std::function<ExitCode(
    const std::filesystem::path& truths, const std::filesystem::path& results, const CommandOutput& out)>;
/// `score` is what `diastole explain --score` runs: nothing of the estimator knows what was hidden.
void add_explain(CommandLine& line, const ExplanationScorer& score);

inline void add_estimator_commands(CommandLine& line, const ExplanationScorer& score) {
  add_images(line);
  add_track(line);
  add_flow(line);
  add_ventricle(line);
  add_fibres(line);
  add_solve(line);
  add_pressure_volume(line);
  add_reconstruct(line);
  add_fit(line);
  add_montecarlo(line);
  add_design(line);
  add_shear(line);
  add_law(line);
  add_report(line);
  add_mesh(line);
  add_effects(line);
  add_reference(line);
  add_explain(line, score);
}

}  // namespace diastole
