#pragma once
// `diastole solve -o FILE ...`: the files a solution is written to, chosen by their endings.
//
//   .vtkhdf   Bezier hexahedra for ParaView (estimator/solution/solution_grid.hpp)
//   .csv      strain and stress at the Gauss points (estimator/solution/gauss_table.hpp)
//   .json     sections and profiles of the last frame for `diastole report` (estimator/io/solution_file.hpp)

#include <CLI/CLI.hpp>
#include <filesystem>
#include <span>
#include <vector>

#include "estimator/io/study.hpp"
#include "estimator/solution/solution_grid.hpp"

namespace diastole {

struct SolutionOutputs {
  std::vector<std::filesystem::path> files;
  bool force = false;
};

void add_output_options(CLI::App& command, SolutionOutputs& outputs);

/// Before the work. Throws InputError if a file has another ending, or may not be replaced.
void require_outputs(const SolutionOutputs& outputs, const Study& study);

void write_outputs(const SolutionOutputs& outputs, const Study& study, const ElasticModel& model,
                   std::span<const SolvedFrame> frames);

}  // namespace diastole
