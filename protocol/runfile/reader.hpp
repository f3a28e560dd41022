#pragma once
// Reads and checks a run file.

#include <filesystem>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

/// Reads a whole run. Throws InputError that names the dataset and the first offending index when the file is
/// missing, not a run file, of a newer format_version, or breaks a rule of `check`.
RecordedRun read_run(const std::filesystem::path& path);

/// The rules that every run obeys: times finite and strictly increasing, datasets of a stream equally long,
/// no NaN outside a declared gap, no infinity, segments in order with a positive period, slices in order within the triggers.
/// Throws InputError with run.file as the file.
void check(const RecordedRun& run);

}  // namespace diastole::runfile
