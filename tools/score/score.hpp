#pragma once
// How often explanations are right: verdicts against what was hidden.
//
// An effect's size is that beside the model's own error: large, medium or small (truth_file.hpp). Of a session that other
// sets fit as well the truth must be among the sets that the answer leaves open, or the answer be silent. A name is wrong
// if it is neither hidden nor, at no more than three times its size, an imperfection of the rig.

#include <array>
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

/// What is asked of a set of sessions: shares from 0 to 1. 0 or 1 where nothing is asked.
struct Targets {
  double none_named = 0.02;
  double large_exact = 0.90;
  double medium_inside = 0.85;
  double small_wrong = 0.02;
  double pairs_exact = 0.70;
  double pairs_false = 0.05;
  double outside_named = 0.10;
  double any_wrong = 0.05;
  std::array<double, 2> interval{0.80, 0.97};
};
/// Of recordings whose model is right but for what is hidden.
inline constexpr Targets exact_model{.none_named = 0,
                                     .large_exact = 0.95,
                                     .medium_inside = 0.95,
                                     .pairs_exact = 0.80,
                                     .interval = {0.85, 0.95}};
/// Of rigs with imperfections and no reference: nothing but silence instead of error is asked.
inline constexpr Targets no_reference{.none_named = 0.05,
                                      .large_exact = 0,
                                      .medium_inside = 0,
                                      .small_wrong = 0.05,
                                      .pairs_exact = 0,
                                      .pairs_false = 0.05,
                                      .interval = {0, 1}};

/// One line of the table of targets.
struct ScoreRow {
  std::string figure;       ///< "none: falsely named"
  std::string target = {};  ///< "<= 1 %"; empty: nothing is asked
  double value = 0.0;       ///< NaN without cases
  size_t hits = 0;          ///< of `cases`, where the figure is a share
  size_t cases = 0;
  std::array<double, 2> interval{0, 1};  ///< of the share, 95 % (Clopper and Pearson, Biometrika 26, 1934)
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

/// Of verdicts said with a confidence in a range, how many are right.
struct Reliability {
  std::array<double, 2> said{};
  double mean = 0.0;  ///< of what was said
  size_t right = 0;
  size_t cases = 0;
};

struct Score {
  std::vector<ScoreRow> rows;
  std::vector<Confusion> confusion;
  std::vector<Reliability> reliability;
  std::vector<std::string> missing;   ///< truths without an explanation
  [[nodiscard]] bool passed() const;  ///< the decisive rows
  [[nodiscard]] bool met() const;     ///< all of them
};

/// Pairs truths with NAME/explanation.json or NAME.json below `results`; those without one go to Score::missing. Throws
/// InputError if none has one or one cannot be read.
Score score_folder(const std::filesystem::path& truths, const std::filesystem::path& results,
                   const Targets& targets = {});
Score score_cases(const std::vector<ScoredCase>& cases, const Targets& targets = {});

/// Of a binomial share, 95 %. Precondition: hits <= cases.
std::array<double, 2> clopper_pearson(size_t hits, size_t cases);

/// Is the answer all that was hidden, and nothing else?
bool is_exact(const ScoredCase& c);
/// What a session hides and what was answered, as the table of answers has them.
std::string hidden_words(const ScoredCase& c);
std::string answer_of(const Explanation& found);

/// The confusion matrix as a list, the table of targets and the reliability, for people.
std::string in_words(const Score& score);
std::string to_json(const Score& score);

// `diastole explain --score TRUTHS RESULTS`.

/// Prints the score; negative if a decisive row misses its target. Throws what score_folder throws.
ExitCode print_score(const std::filesystem::path& truths, const std::filesystem::path& results,
                     const CommandOutput& out);

}  // namespace diastole::explain
