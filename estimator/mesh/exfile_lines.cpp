#include "estimator/mesh/exfile_lines.hpp"

#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::string_view blanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

}  // namespace

ExLines::ExLines(std::string_view text, std::string file) : file_(std::move(file)) {
  size_t number = 0;
  while (!text.empty()) {
    const size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    ++number;
    if (!line.empty() && line.front() != '!') lines_.push_back({std::string(line), number});
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  if (!lines_.empty() && lines_.front().text.starts_with("EX Version")) {
    fail(lines_.front(), "is version 2 of the EX format, which is not read",
         "Write the mesh as exnode and exelem files of the first version, as cmgui and OpenCMISS do.");
  }
}

const ExLine& ExLines::take() {
  if (at_end()) {
    fail(lines_.empty() ? ExLine{"", 1} : lines_.back(), "the file ends too early", "Give the whole file.");
  }
  return lines_[next_++];
}

std::vector<double> ExLines::take_numbers(size_t count, std::string_view what) {
  std::vector<double> numbers;
  while (numbers.size() < count) {
    const ExLine& line = take();
    const std::vector<double> more = numbers_in(line.text);
    if (more.empty() || numbers.size() + more.size() > count) {
      fail(line, fmt::format("{} of {} {} have come, then \"{}\"", numbers.size(), count, what, line.text),
           "Give as many numbers as the header says.");
    }
    numbers.insert(numbers.end(), more.begin(), more.end());
  }
  return numbers;
}

void ExLines::fail(const ExLine& line, std::string problem, std::string remedy) const {
  throw InputError({file_, fmt::format("line {}", line.number), std::move(problem), std::move(remedy)});
}

size_t ExLines::number_after(const ExLine& line, std::string_view mark) const {
  const size_t start = line.text.find(mark);
  size_t value = 0;
  if (start != std::string::npos) {
    const std::string_view rest = trimmed(std::string_view(line.text).substr(start + mark.size()));
    if (std::from_chars(rest.data(), rest.data() + rest.size(), value).ec == std::errc{}) return value;
  }
  fail(line, fmt::format("has no whole number behind \"{}\"", mark),
       "See docs/mesh-file.md for what is read.");
}

bool has(const ExLine& line, std::string_view part) { return line.text.find(part) != std::string::npos; }

std::vector<double> numbers_in(std::string_view text) {
  std::vector<double> numbers;
  while (!(text = trimmed(text)).empty()) {
    if (text.front() == '+') text.remove_prefix(1);
    double value = 0.0;
    const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const auto used = static_cast<size_t>(stopped - text.data());
    if (error != std::errc{} || (used < text.size() && blanks.find(text[used]) == std::string_view::npos))
      return {};
    numbers.push_back(value);
    text.remove_prefix(used);
  }
  return numbers;
}

}  // namespace diastole
