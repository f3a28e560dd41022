#pragma once
// What is looked for, as words on the command line:
//
//   specimen=gel-7  since=2026-11  verdict=unexplained  stiffness_kPa<9  sound=no  note=bubble  swirl
//
// A text is equal without regard to case, `*` stands for anything; protocol, effects, notes, problem and path need only contain it.
// Numbers take = < > <= >=, everything takes !=. A word alone may stand in any of the texts. All must hold.

#include <string>
#include <variant>
#include <vector>

namespace diastole::catalogue {

/// A condition in SQL over the columns of `entries`, with what its question marks stand for.
struct Condition {
  std::string sql;  ///< "1" if nothing is asked
  std::vector<std::variant<std::string, double>> values;
};

/// Throws InputError that names the word, and the nearest known key or what a value must be.
Condition condition_of(const std::vector<std::string>& words);

/// Whether a word names no key, and is looked for in all texts.
bool is_word_alone(const std::string& word);

/// The columns of `entries` by which may be filtered and sorted.
const std::vector<std::string>& keys();

}  // namespace diastole::catalogue
