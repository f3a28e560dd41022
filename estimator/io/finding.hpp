#pragma once
// Something about the data that their user should know before believing a result: what, where, how much, and what to
// do about it. In words for people; `id` for programs.

#include <string>
#include <string_view>
#include <vector>

namespace diastole {

enum class Severity {
  note,     ///< good to know
  warning,  ///< dealt with, or harmless to the method, but not as the data say
  error,    ///< the data cannot mean what they say: results would be wrong
};

constexpr std::string_view describe(Severity severity) {
  return severity == Severity::error ? "error" : severity == Severity::warning ? "warning" : "note";
}

struct Finding {
  Severity severity = Severity::note;
  std::string id;     ///< "wild-points"; the list is in docs/reconstruction.md
  std::string what;   ///< one sentence, with its number
  std::string where;  ///< file column, frame, slice, element
  double number = 0.0;
  std::string unit;    ///< of `number`; empty for a ratio
  std::string remedy;  ///< one sentence
};

inline bool has_error(const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    if (finding.severity == Severity::error) return true;
  }
  return false;
}

}  // namespace diastole
