#include "estimator/io/whole_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <system_error>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannot_be_written(const fs::path& path) {
  throw InputError({path.string(), "", "cannot be written",
                    "Check that the folder exists, that you may write there, and that it has room."});
}

/// What a scanner wrote is no command's to replace.
bool is_dicom(const fs::path& path) {
  std::string mark(4, '\0');
  std::ifstream stream(path, std::ios::binary);
  return stream.seekg(128) && stream.read(mark.data(), 4) && mark == "DICM";
}

bool starts_with_mark(const fs::path& path, std::string_view mark) {
  std::string start(256, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  return start.find(mark) != std::string::npos;
}

bool is_written(const fs::path& file, std::string_view content) {
  std::ofstream stream(file, std::ios::binary);
  stream << content;
  stream.close();
  return static_cast<bool>(stream);
}

}  // namespace

void write_whole_file(const fs::path& path, const std::function<void(const fs::path& unfinished)>& write) {
  const fs::path unfinished = path.string() + "." + std::to_string(::getpid()) + ".part";
  std::error_code error;
  try {
    write(unfinished);
    const fs::path place = fs::is_symlink(path) ? fs::canonical(path, error) : path;
    if (!error) fs::rename(unfinished, place, error);
    if (error) cannot_be_written(path);
  } catch (...) {
    fs::remove(unfinished, error);
    throw;
  }
}

void write_whole_file(const fs::path& path, std::string_view content) {
  write_whole_file(path, [&](const fs::path& unfinished) {
    if (!is_written(unfinished, content)) cannot_be_written(path);
  });
}

void write_durable_file(const fs::path& path, std::string_view content) {
  write_whole_file(path, [&](const fs::path& unfinished) {
    const bool is_whole = is_written(unfinished, content);
    const int file = ::open(unfinished.c_str(), O_RDONLY | O_CLOEXEC);
    const bool is_kept = is_whole && file >= 0 && ::fsync(file) == 0;
    if (file >= 0) ::close(file);
    if (!is_kept) cannot_be_written(path);
  });
}

void require_output(const OutputFile& output) {
  const fs::path folder = fs::absolute(output.path).parent_path();
  if (::access(folder.c_str(), W_OK | X_OK) != 0) cannot_be_written(output.path);
  if (!fs::exists(output.path)) return;
  // A rename would put an ordinary file in the place of a device.
  if (!fs::is_regular_file(output.path)) cannot_be_written(output.path);
  for (const fs::path& input : output.inputs) {
    std::error_code missing;
    if (fs::equivalent(input, output.path, missing)) {
      throw InputError({output.path.string(), "", "is read by this command and cannot be its output too",
                        "Give -o another name."});
    }
  }
  if (is_dicom(output.path))
    throw InputError({output.path.string(), "", "is an image (DICOM), which no command replaces",
                      "Give -o another name."});
  if (output.path.string().ends_with(".run.h5"))
    throw InputError({output.path.string(), "", "is a recording, which no result replaces",
                      "Give the output another name."});
  const bool is_earlier_result = !output.mark.empty() && starts_with_mark(output.path, output.mark);
  if (!output.force && !fs::is_empty(output.path) && !is_earlier_result) {
    throw InputError({output.path.string(), "", "exists already and is no earlier result of this command",
                      "Choose another name, or --force to replace it."});
  }
}

void RequiredOutputs::add(const fs::path& path, std::string_view mark) {
  const fs::path place = fs::weakly_canonical(fs::absolute(path));
  if (std::ranges::count(places_, place) > 0)
    throw InputError(
        {path.string(), "", "is another output of this command too", "Give each a name of its own."});
  require_output({path, inputs_, mark, force_});
  places_.push_back(place);
}

std::string read_whole_file(const fs::path& path, const std::string& remedy) {
  return read_bounded_file(path, most_data_bytes, remedy);
}

}  // namespace diastole
