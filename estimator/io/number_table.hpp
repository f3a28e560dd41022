#pragma once
// Reading of CSV files that hold only numbers under a fixed header, strictly and fast (std::from_chars; some
// ten million numbers a second). Lines end in LF or CRLF; blank lines are allowed at the end only.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace diastole {

class NumberTable {
 public:
  /// `columns`: the header's names in order; they must outlive the table (string literals do).
  /// Of the last `optional` of them a file has all or none.
  /// Throws InputError with file, line and column for a missing or empty file, another header, another number
  /// of columns, and every value that is not a finite number.
  static NumberTable from_file(const std::filesystem::path& path, std::span<const std::string_view> columns,
                               size_t optional = 0);
  /// The same for text that is already in memory; `file` stands for it in messages.
  static NumberTable from_text(std::string_view text, std::string file,
                               std::span<const std::string_view> columns, size_t optional = 0);

  /// Those that the file has.
  [[nodiscard]] size_t columns() const { return columns_.size(); }
  [[nodiscard]] size_t rows() const { return values_.size() / columns_.size(); }
  [[nodiscard]] double at(size_t row, size_t column) const { return values_[row * columns_.size() + column]; }

  /// Throws InputError for the first value beyond 1e12, which no instrument gives in any unit; sums of squares of larger ones may overflow.
  void expect_measurable() const;

  /// The whole number at a place; throws InputError if it has a fraction, is negative or exceeds `at_most`.
  [[nodiscard]] int index_at(size_t row, size_t column, int at_most) const;

  /// Reports a fault of one value: "FILE: line L, column NAME: PROBLEM".
  [[noreturn]] void fail(size_t row, size_t column, std::string problem, std::string remedy) const;

  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  NumberTable(std::string file, std::span<const std::string_view> columns)
      : file_(std::move(file)), columns_(columns) {}
  void parse_row(std::string_view line, size_t line_number);

  std::string file_;
  std::span<const std::string_view> columns_;
  std::vector<double> values_;  // row-major
};

}  // namespace diastole
