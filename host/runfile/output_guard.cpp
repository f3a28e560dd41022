#include "host/runfile/output_guard.hpp"

#include <unistd.h>

#include "host/journal/journal_store.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

void require_new_file(const std::filesystem::path& file, bool force) {
  if (std::filesystem::is_directory(file))
    throw InputError({file.string(), "", "is a directory", "Name a file."});
  if (std::filesystem::exists(file) && !force) {
    throw InputError({file.string(), "", "exists already", "Choose another name, or --force to replace it."});
  }
  const std::filesystem::path directory = file.has_parent_path() ? file.parent_path() : ".";
  if (::access(directory.c_str(), W_OK | X_OK) != 0) {
    throw InputError({directory.string(), "", "is no directory in which you may write",
                      "Make it (mkdir), or choose another place."});
  }
}

void check_output(const std::filesystem::path& output, bool force,
                  const std::vector<std::filesystem::path>& inputs) {
  for (const auto& input : inputs) {
    std::error_code missing;
    if (std::filesystem::equivalent(input, output, missing)) {
      throw InputError({output.string(), "-o", "is what this command reads, and would be replaced",
                        "Name another output."});
    }
  }
  if (is_journal(output)) {
    throw InputError({output.string(), "-o", "is a journal, perhaps all there is of a run",
                      "Name another output; `diastole recover` makes a run file of it."});
  }
  require_new_file(output, force);
}

}  // namespace diastole
