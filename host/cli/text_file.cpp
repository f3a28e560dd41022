#include "host/cli/text_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>

#include "protocol/contract/input_error.hpp"

namespace diastole {

namespace fs = std::filesystem;

void require_new_file(const fs::path& file, bool force) {
  if (fs::is_directory(file)) throw InputError({file.string(), "", "is a directory", "Name a file."});
  if (fs::exists(file) && !force) {
    throw InputError({file.string(), "", "exists already", "Choose another name, or --force to replace it."});
  }
  const fs::path directory = file.has_parent_path() ? file.parent_path() : ".";
  if (::access(directory.c_str(), W_OK | X_OK) != 0) {
    throw InputError({directory.string(), "", "is no directory in which you may write",
                      "Make it (mkdir), or choose another place."});
  }
}

void write_text_file(const fs::path& file, std::string_view content) {
  const fs::path temporary = fmt::format("{}.{}.part", file.string(), ::getpid());
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  std::error_code error;
  if (stream) fs::rename(temporary, file, error);
  if (!stream || error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw HardwareError(file.string(), "cannot be written", "Check the disk's space and your rights there.");
  }
}

}  // namespace diastole
