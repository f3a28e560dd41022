#pragma once
// The file that is written beside a file until it is whole: NAME.PID.part, renamed to NAME at the end. A process that is
// killed leaves its own behind; the next one that writes there tidies it up.

#include <filesystem>
#include <functional>
#include <string_view>

namespace diastole {

/// Of this process.
std::filesystem::path part_file_of(const std::filesystem::path& file);

/// Removes the part files that nobody writes any more: the process is gone, and for a minute nothing was written. Of
/// `file`, or, when it is a directory, of all files in it that end with `.run.h5`.
void remove_leftovers(const std::filesystem::path& file);

/// Has `write` make the part file of `file`, and gives it its name: `file` is whole or was not touched. What `write` throws
/// goes on to the caller, std::filesystem::filesystem_error if the name cannot be given; then nothing is left behind.
void write_whole(const std::filesystem::path& file,
                 const std::function<void(const std::filesystem::path& part)>& write);

/// Makes `to` from the bytes of `from`, brings it to the disk and gives it its name, in this order: `to` is whole or was
/// not touched. Throws std::filesystem::filesystem_error; then nothing is left behind. A `from` without a name is read
/// through /proc/self/fd/N.
void copy_durably(const std::filesystem::path& from, const std::filesystem::path& to);

/// Replaces a file of that name by one with this content. Throws HardwareError if the disk does not take it; then nothing
/// is left behind.
void write_text_file(const std::filesystem::path& file, std::string_view content);

}  // namespace diastole
