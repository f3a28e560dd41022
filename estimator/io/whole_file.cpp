#include "estimator/io/whole_file.hpp"

#include <unistd.h>

#include <fstream>
#include <iterator>
#include <system_error>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

[[noreturn]] void cannot_be_written(const std::filesystem::path& path) {
  throw InputError({path.string(), "", "cannot be written",
                    "Check that the folder exists, that you may write there, and that it has room."});
}

}  // namespace

void write_whole_file(const std::filesystem::path& path, std::string_view content) {
  const std::filesystem::path unfinished = path.string() + ".part";
  std::ofstream stream(unfinished, std::ios::binary);
  stream << content;
  stream.close();
  std::error_code error;
  if (stream) std::filesystem::rename(unfinished, path, error);
  if (!stream || error) {
    std::filesystem::remove(unfinished, error);
    cannot_be_written(path);
  }
}

void require_writable(const std::filesystem::path& path) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  if (std::filesystem::is_directory(path) || ::access(folder.c_str(), W_OK) != 0) cannot_be_written(path);
}

std::string read_whole_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path)) {
    throw InputError(
        {path.string(), "", "cannot be opened",
         "Check the path and that you may read the file; paths in a study are relative to the study."});
  }
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace diastole
