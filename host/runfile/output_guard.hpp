#pragma once
// What a command that writes a file checks before it starts.

#include <filesystem>
#include <vector>

namespace diastole {

/// Throws InputError if the file is a directory, exists and `force` is not given, or lies where one may not write.
void require_new_file(const std::filesystem::path& file, bool force);

/// The same, and also if `output` would, `force` or not, replace one of the `inputs` or any journal.
void check_output(const std::filesystem::path& output, bool force,
                  const std::vector<std::filesystem::path>& inputs);

}  // namespace diastole
