#pragma once
// Reads and checks a run file.

#include <filesystem>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

/// Reads a whole run. Throws InputError that names the dataset and the first offending index when the file is
/// missing, not a run file, of a newer format_version, or breaks a rule of `check`.
RecordedRun read_run(const std::filesystem::path& path);

/// Far beyond any run, and within what arithmetic on times and counts bears without another look.
inline constexpr double longest_time_s = 1e10;
inline constexpr double shortest_period_s = 1e-6;
inline constexpr int64_t most_counted = 1'000'000'000'000;

/// The rules that every run obeys: times within longest_time_s and strictly increasing, datasets of a stream equally
/// long, no NaN outside a declared gap, no infinity, segments in order with a period of shortest_period_s or more,
/// slices in order within the triggers, no negative counts and none beyond most_counted.
/// Throws InputError with run.file as the file.
void check(const RecordedRun& run);

}  // namespace diastole::runfile
