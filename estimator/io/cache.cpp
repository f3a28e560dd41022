#include "estimator/io/cache.hpp"

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "estimator/io/cache_folder.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

std::filesystem::path cache_folder() {
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder != nullptr && *folder != '\0')
    return std::filesystem::path(folder) / "diastole";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::filesystem::path(home) / ".cache" / "diastole";
  return {};
}

std::optional<std::string> read_cached(std::string_view file) {
  const std::filesystem::path folder = cache_folder();
  std::error_code missing;
  if (folder.empty() || !std::filesystem::is_regular_file(folder / file, missing)) return {};
  try {
    return read_whole_file(folder / file);
  } catch (const InputError&) {
    return {};
  }
}

void write_cached(std::string_view file, std::string_view text) {
  const std::filesystem::path folder = cache_folder();
  std::error_code failure;
  if (folder.empty() || (std::filesystem::create_directories(folder, failure), failure)) return;
  try {
    write_whole_file(folder / file, text);
  } catch (const InputError&) {  // computed again next time
  }
}

}  // namespace diastole
