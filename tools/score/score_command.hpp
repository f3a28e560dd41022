#pragma once
// `diastole explain --score TRUTHS RESULTS`.

#include <filesystem>

#include "protocol/contract/command.hpp"

namespace diastole::explain {

/// Prints the score; negative if a decisive row misses its target. Throws what score_folder throws.
ExitCode print_score(const std::filesystem::path& truths, const std::filesystem::path& results,
                     const CommandOutput& out);

}  // namespace diastole::explain
