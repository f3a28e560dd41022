#pragma once
// Writes a run file exactly as docs/run-file.md says: into a temporary file beside it, brought to the disk,
// then renamed, so that a file of that name is always whole. A run that is made of a journal is written as it is read:
// memory does not grow with its length.

#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include "host/runfile/assemble.hpp"

namespace diastole {

/// As fsync(2), for the file's directory.
using FlushDirectory = std::function<int(int descriptor)>;

/// Replaces a file of that name. Throws InputError if the run breaks a rule of runfile::check, and
/// HardwareError if the disk does not take the file; then nothing is left behind. Returns what is to be said of a file
/// that is whole all the same: that the disk has not confirmed its name. Empty: nothing.
std::string write_run(const std::filesystem::path& path, const StreamedRun& run,
                      const FlushDirectory& flush_directory = ::fsync);

}  // namespace diastole
