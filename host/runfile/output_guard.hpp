#pragma once
// What a command that writes a run file checks before it starts.

#include <filesystem>
#include <vector>

namespace diastole {

/// Throws InputError if `output` is a directory, exists and `force` is not given, lies where one may not write,
/// or would, `force` or not, replace one of the `inputs` or any journal.
void check_output(const std::filesystem::path& output, bool force,
                  const std::vector<std::filesystem::path>& inputs);

}  // namespace diastole
