#pragma once
// Runs a program to its end and measures it as a whole: time, processor time and peak memory, its own children's
// processor time included.

#include <filesystem>
#include <string>
#include <vector>

namespace diastole {

struct ProcessCost {
  int exit_code = -1;  ///< -1: not started, or killed by a signal
  double wall_s = 0.0;
  double processor_s = 0.0;  ///< user and system
  double peak_MB = 0.0;      ///< resident memory of the largest process
};

/// `command[0]` is looked for in PATH; the program's output goes to `log`, its directory is `folder`. Numerical
/// libraries are set to use one thread. Throws std::system_error when the machine starts no process at all.
ProcessCost run_timed(const std::vector<std::string>& command, const std::filesystem::path& folder,
                      const std::filesystem::path& log);

}  // namespace diastole
