#include "protocol/runfile/frame_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::runfile {
namespace {

constexpr double s_per_ms = 1e-3;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    cells.emplace_back(trimmed(cell));
  }
  return cells;
}

/// The cells of one line under the header's names.
class Row {
 public:
  Row(const std::string& file, size_t line, const std::vector<std::string>& names, const std::string& text)
      : file_(file), line_(line), names_(names), cells_(cells_of(text)) {
    if (cells_.size() != names_.size()) {
      fail("", fmt::format("has {} cells, the header {}", cells_.size(), names_.size()),
           "Write one frame a line, its cells separated by commas.");
    }
  }

  [[nodiscard]] std::optional<double> number(const std::string& column) const {
    const auto found = std::ranges::find(names_, column);
    if (found == names_.end()) return std::nullopt;
    const std::string& cell = cells_[static_cast<size_t>(found - names_.begin())];
    const auto value = parse_number<double>(cell);
    if (!value || !(*value > -1e9 && *value < 1e9)) {
      fail(column, fmt::format("\"{}\" is not a number", cell),
           "Give milliseconds from the trigger, like 70.5.");
    }
    return value;
  }

  [[noreturn]] void fail(const std::string& column, std::string problem, std::string remedy) const {
    const std::string place = column.empty() ? "" : fmt::format(", column {}", column);
    throw InputError({file_, fmt::format("line {}{}", line_, place), std::move(problem), std::move(remedy)});
  }

 private:
  const std::string& file_;
  size_t line_;
  const std::vector<std::string>& names_;
  std::vector<std::string> cells_;
};

FrameStart start_of(const Row& row, const std::vector<FrameStart>& before) {
  if (const auto frame = row.number("frame"); frame && *frame != static_cast<double>(before.size())) {
    row.fail("frame", fmt::format("is {}, but {} is next", *frame, before.size()),
             "List the frames 0, 1, 2, ... in the order of their times.");
  }
  FrameStart start{.from_s = s_per_ms * *row.number("trigger_time_ms")};
  if (!before.empty() && start.from_s <= before.back().from_s) {
    row.fail("trigger_time_ms",
             fmt::format("{:g} ms does not follow {:g} ms", 1e3 * start.from_s, 1e3 * before.back().from_s),
             "Sort the frames by their time after the trigger.");
  }
  if (const auto width_ms = row.number("width_ms")) {
    if (*width_ms <= 0) row.fail("width_ms", fmt::format("{:g} ms is no width", *width_ms), "Give it in ms.");
    start.width_s = s_per_ms * *width_ms;
  }
  return start;
}

}  // namespace

std::vector<FrameWindow> equal_windows(size_t frames, double period_s) {
  std::vector<FrameWindow> windows;
  const double length_s = period_s / static_cast<double>(frames);
  for (size_t k = 0; k < frames; ++k) {
    windows.push_back({static_cast<double>(k) * length_s, static_cast<double>(k + 1) * length_s});
  }
  return windows;
}

std::vector<FrameStart> repeated_starts(size_t frames, double first_s, double repetition_s) {
  std::vector<FrameStart> starts;
  for (size_t k = 0; k < frames; ++k)
    starts.push_back({first_s + static_cast<double>(k) * repetition_s, repetition_s});
  return starts;
}

std::vector<FrameStart> read_frame_times(const std::filesystem::path& file) {
  return parse_frame_times(read_bounded_file(file, most_table_bytes), file.string());
}

std::vector<FrameStart> parse_frame_times(const std::string& text, const std::string& file) {
  std::stringstream stream(text);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> names = cells_of(line);
  if (std::ranges::find(names, "trigger_time_ms") == names.end()) {
    throw InputError({file, "line 1", "names no column trigger_time_ms",
                      "Begin with a header such as frame,trigger_time_ms,width_ms."});
  }
  std::vector<FrameStart> starts;
  for (size_t number = 2; std::getline(stream, line); ++number) {
    if (trimmed(line).empty()) continue;
    starts.push_back(start_of(Row(file, number, names, line), starts));
  }
  if (starts.empty()) throw InputError({file, "", "lists no frame", "Write one frame a line."});
  return starts;
}

std::vector<FrameWindow> windows_of(const std::vector<FrameStart>& starts, std::optional<double> width_s,
                                    double interval_s) {
  std::vector<FrameWindow> windows;
  for (size_t k = 0; k < starts.size(); ++k) {
    const double from_s = starts[k].from_s;
    if (const auto width = width_s ? width_s : starts[k].width_s) {
      windows.push_back({from_s, from_s + *width});
    } else if (k + 1 < starts.size()) {
      windows.push_back({from_s, starts[k + 1].from_s});
    } else {
      const double like_before_s = k > 0 ? from_s - starts[k - 1].from_s : interval_s;
      windows.push_back({from_s, std::min(from_s + like_before_s, std::max(interval_s, from_s))});
    }
  }
  return windows;
}

}  // namespace diastole::runfile
