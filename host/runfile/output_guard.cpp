#include "host/runfile/output_guard.hpp"

#include <unistd.h>

#include "host/journal/journal_store.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

void check_output(const std::filesystem::path& output, bool force,
                  const std::vector<std::filesystem::path>& inputs) {
  if (std::filesystem::is_directory(output)) {
    throw InputError({output.string(), "", "is a directory", "Name a file, for example session.run.h5."});
  }
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
  if (std::filesystem::exists(output) && !force) {
    throw InputError(
        {output.string(), "", "exists already", "Choose another name, or --force to replace it."});
  }
  const auto directory = output.has_parent_path() ? output.parent_path() : std::filesystem::path(".");
  if (::access(directory.c_str(), W_OK | X_OK) != 0) {
    throw InputError({directory.string(), "", "is no directory in which you may write",
                      "Make it (mkdir), or choose another place for -o."});
  }
}

}  // namespace diastole
