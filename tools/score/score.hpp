#pragma once
// How often explanations are right: verdicts against what was hidden.
//
// A single effect is *separable* if no other set fits as well and it is 8 noise sigmas large or more. A single or pair that
// has alternatives is judged with the inseparable ones: there the truth must be among the sets that the answer
// leaves open, and "none" is right where no effect fits as well.

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"
#include "protocol/contract/command.hpp"
#include "tools/score/truth_file.hpp"

namespace diastole::explain {

struct ScoredCase {
  Truth truth;
  Explanation found;
};

/// One line of the table of targets.
struct ScoreRow {
  std::string figure;       ///< "none: falsely named"
  std::string target = {};  ///< "<= 1 %"
  double value = 0.0;       ///< NaN without cases
  size_t hits = 0;          ///< of `cases`, where the figure is a share
  size_t cases = 0;
  bool is_share = true;
  bool met = true;        ///< also without cases
  bool decisive = false;  ///< missing it fails the whole
};

/// How often a truth got an answer.
struct Confusion {
  std::string hidden;
  std::string answer;
  size_t count = 0;
  bool right = false;
};

struct Score {
  std::vector<ScoreRow> rows;
  std::vector<Confusion> confusion;
  std::vector<std::string> missing;  ///< truths without an explanation
  [[nodiscard]] bool passed() const;
};

/// Pairs truths with NAME/explanation.json or NAME.json below `results`; those without one go to Score::missing. Throws
/// InputError if none has one or one cannot be read.
Score score_folder(const std::filesystem::path& truths, const std::filesystem::path& results);
Score score_cases(const std::vector<ScoredCase>& cases);

/// The confusion matrix as a list and the table of targets, for people.
std::string in_words(const Score& score);
std::string to_json(const Score& score);

// `diastole explain --score TRUTHS RESULTS`.

/// Prints the score; negative if a decisive row misses its target. Throws what score_folder throws.
ExitCode print_score(const std::filesystem::path& truths, const std::filesystem::path& results,
                     const CommandOutput& out);

}  // namespace diastole::explain
