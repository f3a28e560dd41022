#pragma once
// Writes a run file exactly as docs/run-file.md says: into a temporary file beside it, brought to the disk,
// then renamed, so that a file of that name is always whole.

#include <filesystem>

#include "protocol/runfile/run.hpp"

namespace diastole {

/// Replaces a file of that name. Throws InputError if the run breaks a rule of runfile::check, and
/// HardwareError if the disk does not take the file; then nothing is left behind.
void write_run(const std::filesystem::path& path, const runfile::RecordedRun& run);

}  // namespace diastole
