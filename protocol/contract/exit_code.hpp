#pragma once
// The exit codes of every Diastole program.

namespace diastole {

enum class ExitCode : int {
  done = 0,       ///< it did what was asked
  negative = 1,   ///< it ran, but the answer is negative: a failed check, gaps in a run, a lossy recovery
  bad_input = 2,  ///< wrong usage or unreadable input
  hardware_fault = 3,  ///< a device or link failed
};

}  // namespace diastole
