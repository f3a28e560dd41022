#include "estimator/io/number_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

std::string_view take_field(std::string_view& rest) {
  const size_t comma = rest.find(',');
  const std::string_view field = trimmed(rest.substr(0, comma));
  rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
  return field;
}

/// How many columns the file has: all, or all but the last `optional`.
size_t check_header(std::string_view line, const std::string& file, std::span<const std::string_view> columns,
                    size_t optional) {
  std::string_view rest = without_byte_order_mark(line);
  const std::string remedy = fmt::format("The header must read: {}", fmt::join(columns, ","));
  size_t count = columns.size() - optional;
  for (size_t i = 0; i < count; ++i) {
    const std::string_view found = take_field(rest);
    if (found != columns[i])
      throw InputError({file, "line 1",
                        fmt::format("the header has \"{}\" where \"{}\" belongs", found, columns[i]),
                        remedy});
    const bool has_more =
        i + 1 == count && count < columns.size() && trimmed(rest).starts_with(columns[count]);
    if (has_more) count = columns.size();
  }
  if (!rest.empty()) {
    throw InputError({file, "line 1", fmt::format("the header has a column too many: \"{}\"", rest), remedy});
  }
  return count;
}

}  // namespace

NumberTable NumberTable::from_file(const std::filesystem::path& path,
                                   std::span<const std::string_view> columns, size_t optional) {
  constexpr const char* remedy =
      "Check the path and that you may read the file; paths in a study are relative to the study.";
  return from_text(read_whole_file(path, remedy), path.string(), columns, optional);
}

NumberTable NumberTable::from_text(std::string_view text, std::string file,
                                   std::span<const std::string_view> columns, size_t optional) {
  NumberTable table(std::move(file), columns);
  if (trimmed(text).empty()) {
    throw InputError(
        {table.file_, "", "the file is empty",
         fmt::format("It must hold the header {} and one row or more.", fmt::join(columns, ","))});
  }
  size_t line_number = 0;
  size_t first_blank = 0;
  while (!text.empty()) {
    const size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++line_number;
    if (line_number == 1) {
      table.columns_ = columns.first(check_header(line, table.file_, columns, optional));
    } else if (line.empty()) {
      if (first_blank == 0) first_blank = line_number;
    } else if (first_blank != 0) {
      throw InputError(
          {table.file_, fmt::format("line {}", first_blank), "a blank line inside the table", "Remove it."});
    } else {
      table.parse_row(line, line_number);
    }
  }
  if (table.values_.empty()) {
    throw InputError({table.file_, "line 2", "there is a header but no row", "Add the measured rows."});
  }
  return table;
}

void NumberTable::parse_row(std::string_view line, size_t line_number) {
  std::string_view rest = line;
  for (size_t column = 0; column < columns_.size(); ++column) {
    if (rest.empty()) {
      throw InputError({file_, fmt::format("line {}", line_number),
                        fmt::format("{} columns where {} belong", column, columns_.size()),
                        fmt::format("Columns are {}.", fmt::join(columns_, ","))});
    }
    const std::string_view field = take_field(rest);
    const auto value = parse_number<double>(field);
    if (!value || !std::isfinite(*value)) {
      throw InputError({file_, fmt::format("line {}, column {}", line_number, columns_[column]),
                        fmt::format("\"{}\" is not a finite number", field),
                        "Write a decimal number with a point, or leave the row out if it was not measured."});
    }
    values_.push_back(*value);
  }
  if (!rest.empty() || line.ends_with(',')) {
    throw InputError({file_, fmt::format("line {}", line_number),
                      fmt::format("more than the {} columns that belong there", columns_.size()),
                      fmt::format("Columns are {}.", fmt::join(columns_, ","))});
  }
}

void NumberTable::expect_measurable() const {
  constexpr double most = 1e12;
  const auto found = std::ranges::find_if(values_, [](double value) { return std::abs(value) > most; });
  if (found == values_.end()) return;
  const auto at = static_cast<size_t>(found - values_.begin());
  fail(at / columns_.size(), at % columns_.size(), fmt::format("{} is beyond what was ever measured", *found),
       "Correct the value, or the unit: the column's name states it.");
}

int NumberTable::index_at(size_t row, size_t column, int at_most) const {
  const double value = at(row, column);
  if (value < 0 || value > at_most || value != std::floor(value)) {
    fail(row, column, fmt::format("{} is not a whole number from 0 to {}", value, at_most),
         "Frames are counted 0 (undeformed), 1, 2, ...");
  }
  return static_cast<int>(value);
}

void NumberTable::fail(size_t row, size_t column, std::string problem, std::string remedy) const {
  throw InputError({file_, fmt::format("line {}, column {}", row + 2, columns_[column]), std::move(problem),
                    std::move(remedy)});
}

}  // namespace diastole
