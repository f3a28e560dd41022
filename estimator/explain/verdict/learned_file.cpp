#include "estimator/explain/verdict/learned_file.hpp"

#include <string>

#include "estimator/io/fingerprint.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view mark = "# Learnt by diastole explain";

std::string text_of(std::string_view toml) {
  return fmt::format("{}, a suggestion; fingerprint {}\n{}", mark, fingerprint_of(toml), toml);
}

bool is_as_written(const fs::path& path) {
  const std::string text = read_whole_file(path);
  const size_t line = text.find('\n');
  return line != std::string::npos && text == text_of(std::string_view(text).substr(line + 1));
}

}  // namespace

std::string learned_id(size_t law) { return law == 0 ? "learned" : fmt::format("learned-{}", law + 1); }

fs::path learned_file_name(size_t law) { return learned_id(law) + ".effect.toml"; }

void require_learned_file(const fs::path& path, const std::vector<fs::path>& inputs, bool force) {
  require_output({path, inputs, mark, force});
  if (force || !fs::exists(path) || fs::is_empty(path) || is_as_written(path)) return;
  throw InputError({path.string(), "", "was changed since it was learnt, and would be replaced",
                    "Give it another name, choose another folder, or --force to replace it."});
}

void write_learned_file(const fs::path& path, std::string_view toml) {
  write_whole_file(path, text_of(toml));
}

void remove_learned_file(const fs::path& path) {
  std::error_code error;
  if (fs::is_regular_file(path, error) && is_as_written(path)) fs::remove(path, error);
}

}  // namespace diastole::explain
