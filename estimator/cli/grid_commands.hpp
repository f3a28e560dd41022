#pragma once
// `diastole mesh points` and `mesh surface`: what a study takes from other laboratories' grids (estimator/grids).

#include "estimator/cli/commands.hpp"

namespace diastole {

/// Of --unit: "mm", "cm" or "m".
double mm_per_unit(const std::string& unit);

/// Adds them below `mesh`.
void add_grid_commands(CLI::App& mesh, CommandLine& line);

}  // namespace diastole
