#pragma once
// The estimator's subcommands.

#include "protocol/contract/command.hpp"

namespace diastole {

void add_solve(CommandLine& line);
void add_pressure_volume(CommandLine& line);
void add_fit(CommandLine& line);
void add_reconstruct(CommandLine& line);
void add_montecarlo(CommandLine& line);
void add_design(CommandLine& line);
void add_shear(CommandLine& line);
void add_report(CommandLine& line);
void add_mesh(CommandLine& line);
void add_effects(CommandLine& line);
void add_explain(CommandLine& line);

void add_estimator_commands(CommandLine& line);

}  // namespace diastole
