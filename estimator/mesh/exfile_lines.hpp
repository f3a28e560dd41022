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
  /// The same for numbers that count or name something (whole_numbers_in).
  std::vector<size_t> take_whole_numbers(size_t count, std::string_view what);

  [[noreturn]] void fail(const ExLine& line, std::string problem, std::string remedy) const;
  /// The whole number behind `mark` in a line ("#Nodes=" in "#Nodes= 8"), at least `least` and at most
  /// largest_whole_number.
  [[nodiscard]] size_t number_after(const ExLine& line, std::string_view mark, size_t least = 0) const;

 private:
  template <class Read>
  auto take_list(size_t count, std::string_view what, const Read& read);

  std::vector<ExLine> lines_;
  size_t next_ = 0;
  std::string file_;
};

bool has(const ExLine& line, std::string_view part);

/// Sums and products of a few of them stay far within size_t.
inline constexpr size_t largest_whole_number = 1'000'000'000;

/// The text's numbers, all finite; empty if it holds anything else.
std::vector<double> numbers_in(std::string_view text);
/// The text's whole numbers from 0 to largest_whole_number, written without point or sign; empty if it holds
/// anything else.
std::vector<size_t> whole_numbers_in(std::string_view text);

}  // namespace diastole
