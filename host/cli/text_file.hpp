#pragma once
// Writing a small result file whole or not at all.

#include <filesystem>
#include <string_view>

namespace diastole {

/// Replaces a file of that name. Throws HardwareError if the disk does not take it; then nothing is left behind.
void write_text_file(const std::filesystem::path& file, std::string_view content);

}  // namespace diastole
