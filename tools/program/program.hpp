#pragma once
// What the main functions of the simulators share.

#include <CLI/CLI.hpp>
#include <functional>

#include "protocol/contract/exit_code.hpp"

namespace diastole {

/// A descriptor that becomes readable on SIGTERM and SIGINT, which no longer end the program.
int stop_descriptor();

/// Parses the command line and returns the exit code of `action`. Wrong usage, InputError and HardwareError are printed
/// on standard error, the latter two behind the program's name.
int run_program(CLI::App& app, int argc, char** argv, const std::function<ExitCode()>& action);

}  // namespace diastole
