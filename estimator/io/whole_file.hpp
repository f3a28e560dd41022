#pragma once
// Files that are written whole or not at all, and read whole.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace diastole {

/// Writes under a temporary name beside `path`, then renames. Throws InputError if it cannot; nothing remains
/// then.
void write_whole_file(const std::filesystem::path& path, std::string_view content);
/// Has `write` do it, which throws what it likes if it cannot.
void write_whole_file(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& unfinished)>& write);

/// The same, and the disk has it when this returns: what a person has done is in no other file.
void write_durable_file(const std::filesystem::path& path, std::string_view content);

struct OutputFile {
  std::filesystem::path path;
  std::vector<std::filesystem::path> inputs;  ///< what the command reads: never replaced
  std::string_view
      mark;  ///< text near the start of an earlier result, which is replaced without being asked; none is if empty
  bool force = false;  ///< replaces any other ordinary file
};

/// Before long work, so that neither its result nor an input is lost. Throws InputError if the path cannot
/// become a file, is one of the inputs under whatever name, is a DICOM image (by its preamble), or holds something else and there is no `force`.
void require_output(const OutputFile& output);

/// The same of each of several outputs of one command, which must have a name each.
class RequiredOutputs {
 public:
  RequiredOutputs(std::vector<std::filesystem::path> inputs, bool force)
      : inputs_(std::move(inputs)), force_(force) {}

  void add(const std::filesystem::path& path, std::string_view mark);
  /// Nothing where none is wanted.
  void add(const std::optional<std::filesystem::path>& path, std::string_view mark) {
    if (path) add(*path, mark);
  }

 private:
  std::vector<std::filesystem::path> inputs_;
  bool force_;
  std::vector<std::filesystem::path> places_;
};

/// Throws InputError, with this remedy, if the file is missing, a folder or unreadable.
std::string read_whole_file(const std::filesystem::path& path,
                            const std::string& remedy = "Check the path and that you may read the file.");

}  // namespace diastole
