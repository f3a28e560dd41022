#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace diastole {

/// Why a command line is refused, in words: of which command, what the option is for or what its value ought to be, and where to
/// read on. Two lines, without the program's name before them.
std::string refusal(const CLI::App& app, const CLI::ParseError& error);

}  // namespace diastole
