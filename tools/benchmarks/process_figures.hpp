#pragma once
// What a running process costs, from /proc.

#include <sys/types.h>

#include <span>

namespace diastole {

struct ProcessFigures {
  double cpu_s = 0;  ///< user and system time since its start, all threads
  double resident_MB = 0;
  double most_resident_MB = 0;  ///< since its start
};

/// All 0 if there is no such process.
ProcessFigures figures_of(pid_t process);

/// Slope of the least-squares line through what was measured at equal intervals, per interval; 0 for fewer than two.
double slope_per_interval(std::span<const double> values);

}  // namespace diastole
