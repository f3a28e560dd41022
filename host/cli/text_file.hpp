#pragma once
// Writing a small result file whole or not at all.

#include <filesystem>
#include <string_view>

namespace diastole {

/// Throws InputError if the file exists (unless `force`) or its directory cannot be written.
void require_new_file(const std::filesystem::path& file, bool force);

/// Replaces a file of that name. Throws HardwareError if the disk does not take it; then nothing is left behind.
void write_text_file(const std::filesystem::path& file, std::string_view content);

}  // namespace diastole
