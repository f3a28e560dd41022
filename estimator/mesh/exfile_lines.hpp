#pragma once
// The lines of an exnode or exelem file, with their numbers, and how their parts are read. Errors name file,
// line and remedy (InputError).

#include <string>
#include <string_view>
#include <vector>

namespace diastole {

struct ExLine {
  std::string text;  ///< without blanks at either end; never empty
  size_t number;
};

class ExLines {
 public:
  /// Throws InputError for version 2 of the format.
  ExLines(std::string_view text, std::string file);

  [[nodiscard]] bool at_end() const { return next_ == lines_.size(); }
  [[nodiscard]] const ExLine& peek() const { return lines_[next_]; }
  const ExLine& take();

  /// Numbers from here on, over as many lines as `count` of them take. Throws if something else comes first.
  std::vector<double> take_numbers(size_t count, std::string_view what);

  [[noreturn]] void fail(const ExLine& line, std::string problem, std::string remedy) const;
  /// The whole number behind `mark` in a line ("#Nodes=" in "#Nodes= 8").
  [[nodiscard]] size_t number_after(const ExLine& line, std::string_view mark) const;

 private:
  std::vector<ExLine> lines_;
  size_t next_ = 0;
  std::string file_;
};

bool has(const ExLine& line, std::string_view part);

/// The text's numbers; empty if it holds anything else.
std::vector<double> numbers_in(std::string_view text);

}  // namespace diastole
