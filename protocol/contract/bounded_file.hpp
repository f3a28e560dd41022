#pragma once
// Files of a person's, read whole: never more of one than such a file has.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace diastole {

inline constexpr uint64_t megabyte = 1'000'000;
/// Rig, experiment, study, effect and law files: some kilobytes, written by hand.
inline constexpr uint64_t most_settings_bytes = 4 * megabyte;
/// Tables that stand beside them: waveforms' points, frame times.
inline constexpr uint64_t most_table_bytes = 32 * megabyte;
/// Tags, guide points, records in JSON, choices, images: what programs write. A record with fields has some 20 MB.
inline constexpr uint64_t most_data_bytes = 512 * megabyte;

/// The whole file. Throws InputError with its name: missing, a folder or unreadable (with `remedy`), or longer than `most_bytes`,
/// which is found before memory is taken.
std::string read_bounded_file(const std::filesystem::path& path, uint64_t most_bytes,
                              const std::string& remedy = "Check the path and that you may read the file.");

/// Whether a file is HDF5, as run files are, by its first bytes.
inline bool is_hdf5(std::string_view content) { return content.starts_with("\x89HDF"); }

}  // namespace diastole
