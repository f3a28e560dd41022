#include "tools/score/score_command.hpp"

#include <fmt/format.h>

#include "tools/score/score.hpp"

namespace diastole::explain {

ExitCode print_score(const std::filesystem::path& truths, const std::filesystem::path& results,
                     const CommandOutput& out) {
  const Score score = score_folder(truths, results);
  fmt::print("{}", out.json ? to_json(score) + "\n" : in_words(score));
  return score.passed() ? ExitCode::done : ExitCode::negative;
}

}  // namespace diastole::explain
