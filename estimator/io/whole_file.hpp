#pragma once
// Files that are written whole or not at all, and read whole.

#include <filesystem>
#include <string>
#include <string_view>

namespace diastole {

/// Writes under a temporary name beside `path`, then renames. Throws InputError if it cannot; nothing remains
/// then.
void write_whole_file(const std::filesystem::path& path, std::string_view content);

/// Throws InputError if `path` cannot become a file: before long work, so that its result is not lost.
void require_writable(const std::filesystem::path& path);

/// Throws InputError if the file is missing, a folder or unreadable.
std::string read_whole_file(const std::filesystem::path& path);

}  // namespace diastole
