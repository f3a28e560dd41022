#pragma once
// `diastole mesh points` and `mesh surface`: what a study takes from other laboratories' grids (estimator/grids).

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/cli/commands.hpp"

namespace diastole {

/// Of --unit: "mm", "cm" or "m".
double mm_per_unit(const std::string& unit);

/// What a `mesh` command has written.
struct WrittenMesh {
  std::filesystem::path file;
  size_t elements = 0;
  size_t nodes = 0;  ///< or points
  bool has_fibres = false;
  std::vector<std::string> remarks;
};
/// The same document of all of them; for people the remarks, and `sentence` with the file after it.
ExitCode report_written(const WrittenMesh& written, std::string_view sentence, const CommandOutput& out);

/// Adds them below `mesh`.
void add_grid_commands(CLI::App& mesh, CommandLine& line);

}  // namespace diastole
