#include "estimator/mesh/exfile_lines.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

constexpr std::string_view blanks = " \t\r";

bool is_allowed(double value) { return std::isfinite(value); }
bool is_allowed(size_t value) { return value <= largest_whole_number; }

/// The text's numbers of one kind; empty if it holds anything else.
template <class Number>
std::vector<Number> list_in(std::string_view text) {
  std::vector<Number> numbers;
  while (!(text = trimmed(text)).empty()) {
    if (text.front() == '+') text.remove_prefix(1);
    Number value{};
    const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const auto used = static_cast<size_t>(stopped - text.data());
    if (error != std::errc{} || !is_allowed(value) ||
        (used < text.size() && blanks.find(text[used]) == std::string_view::npos))
      return {};
    numbers.push_back(value);
    text.remove_prefix(used);
  }
  return numbers;
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

template <class Read>
auto ExLines::take_list(size_t count, std::string_view what, const Read& read) {
  decltype(read(std::string_view())) numbers;
  while (numbers.size() < count) {
    const ExLine& line = take();
    const auto more = read(line.text);
    if (more.empty() || numbers.size() + more.size() > count) {
      fail(line, fmt::format("{} of {} {} have come, then \"{}\"", numbers.size(), count, what, line.text),
           "Give as many numbers as the header says.");
    }
    numbers.insert(numbers.end(), more.begin(), more.end());
  }
  return numbers;
}

std::vector<double> ExLines::take_numbers(size_t count, std::string_view what) {
  return take_list(count, what, numbers_in);
}

std::vector<size_t> ExLines::take_whole_numbers(size_t count, std::string_view what) {
  return take_list(count, what, whole_numbers_in);
}

void ExLines::fail(const ExLine& line, std::string problem, std::string remedy) const {
  throw InputError({file_, fmt::format("line {}", line.number), std::move(problem), std::move(remedy)});
}

size_t ExLines::number_after(const ExLine& line, std::string_view mark, size_t least) const {
  const size_t start = line.text.find(mark);
  size_t value = 0;
  if (start != std::string::npos) {
    const std::string_view rest = trimmed(std::string_view(line.text).substr(start + mark.size()));
    if (std::from_chars(rest.data(), rest.data() + rest.size(), value).ec == std::errc{}) {
      if (value >= least && value <= largest_whole_number) return value;
      fail(line,
           fmt::format("has {} behind \"{}\", which is not {} to {}", value, mark, least,
                       largest_whole_number),
           fmt::format("It is a whole number from {} on; export the file anew.", least));
    }
  }
  fail(line, fmt::format("has no whole number behind \"{}\"", mark),
       "See docs/mesh-file.md for what is read.");
}

bool has(const ExLine& line, std::string_view part) { return line.text.find(part) != std::string::npos; }

std::vector<double> numbers_in(std::string_view text) { return list_in<double>(text); }

std::vector<size_t> whole_numbers_in(std::string_view text) { return list_in<size_t>(text); }

}  // namespace diastole
