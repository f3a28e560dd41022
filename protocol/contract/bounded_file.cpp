#include "protocol/contract/bounded_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "protocol/contract/input_error.hpp"

namespace diastole {

std::string read_bounded_file(const std::filesystem::path& path, uint64_t most_bytes,
                              const std::string& remedy) {
  std::ifstream stream(path, std::ios::binary);
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(path, ignored);
  if (!stream || is_folder)
    throw InputError(
        {path.string(), "", is_folder ? "cannot be opened: it is a folder" : "cannot be opened", remedy});
  const auto too_long = [&](const std::string& bytes) {
    throw InputError(
        {path.string(), "",
         fmt::format("has {} bytes; files of this kind are read up to {} MB", bytes, most_bytes / megabyte),
         "Check that it is the file that you meant."});
  };
  // A pipe or a device has no size, and is read until it ends or is too long.
  const bool has_size = std::filesystem::is_regular_file(path, ignored);
  const uint64_t size = has_size ? std::filesystem::file_size(path, ignored) : 0;
  if (size > most_bytes && !ignored) too_long(fmt::to_string(size));
  std::string content;
  if (has_size && !ignored) content.reserve(size);
  std::array<char, 65536> block{};
  while (stream.read(block.data(), block.size()), stream.gcount() > 0) {
    content.append(block.data(), static_cast<size_t>(stream.gcount()));
    if (content.size() > most_bytes) too_long(fmt::format("more than {}", most_bytes));
  }
  return content;
}

}  // namespace diastole
