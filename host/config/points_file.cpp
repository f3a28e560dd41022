#include "host/config/points_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

constexpr size_t most_bytes = 384U << 10;
constexpr double closure = 1e-4;  // of the range

/// The rows of the table with the lines they stand in.
class PointsReader {
 public:
  PointsReader(std::string_view text, const std::string& file, PointsOf of)
      : file_(file), of_(of), bytes_(text.size()) {
    text = without_byte_order_mark(text);
    size_t line = 0;
    while (!text.empty()) {
      const size_t end = std::min(text.find('\n'), text.size());
      const std::string_view row = text.substr(0, end);
      take_line(++line, trimmed(row.substr(0, row.find('#'))));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (first_name.empty()) fail(1, "is empty", "The first line names the columns: phase,fraction.");
    if (first.size() < 3) {
      fail(std::max<size_t>(line, 1), fmt::format("has {} points", first.size()),
           "A waveform has at least three: the first, another, and the last, which closes the cycle.");
    }
  }

  [[noreturn]] void fail(size_t line, std::string problem, std::string remedy) const {
    throw InputError({file_, fmt::format("line {}", line), std::move(problem), std::move(remedy)});
  }

  std::string_view first_name, second_name;
  std::vector<double> first, second;
  std::vector<size_t> lines;

 private:
  void take_line(size_t line, std::string_view row) {
    if (row.empty()) return;
    const size_t comma = row.find(',');
    if (comma == std::string_view::npos || row.find(',', comma + 1) != std::string_view::npos) {
      fail(line, shown(row) + " is not two columns",
           first_name.empty() ? names_remedy() : "Separate two columns with one comma.");
    }
    const std::string_view left = trimmed(row.substr(0, comma)), right = trimmed(row.substr(comma + 1));
    if (first_name.empty()) return take_names(line, left, right);
    first.push_back(number(line, left));
    second.push_back(number(line, right));
    lines.push_back(line);
  }
  void take_names(size_t line, std::string_view left, std::string_view right) {
    const bool pressure = of_ == PointsOf::volume_or_pressure;
    if ((left != "phase" && left != "time_s") ||
        (right != "fraction" && right != "volume_mL" && !(pressure && right == "pressure_kPa"))) {
      fail(line, fmt::format("names the columns {} and {}", shown(left), shown(right)), names_remedy());
    }
    if (bytes_ > most_bytes) {
      fail(line, fmt::format("begins points of {} bytes, and at most {} are taken", bytes_, most_bytes),
           "Give fewer points: the controller holds 4096.");
    }
    first_name = left;
    second_name = right;
  }
  static std::string shown(std::string_view text) {
    constexpr size_t most = 200;
    return text.size() > most ? fmt::format("a text of {} bytes", text.size()) : fmt::format("\"{}\"", text);
  }
  [[nodiscard]] std::string names_remedy() const {
    const bool pressure = of_ == PointsOf::volume_or_pressure;
    return fmt::format("The first line names two, with one comma: phase or time_s, and fraction{} or {}.",
                       pressure ? ", volume_mL" : "", pressure ? "pressure_kPa" : "volume_mL");
  }
  [[nodiscard]] double number(size_t line, std::string_view word) const {
    const auto value = parse_number<double>(word);
    if (!value || !std::isfinite(*value))
      fail(line, fmt::format("\"{}\" is no number", word), "Use a decimal point.");
    return *value;
  }

  const std::string& file_;
  PointsOf of_;
  size_t bytes_;
};

/// The first column as phases.
std::vector<double> phases(const PointsReader& rows) {
  const bool time = rows.first_name == "time_s";
  for (size_t i = 1; i < rows.first.size(); ++i) {
    if (rows.first[i] > rows.first[i - 1]) continue;
    rows.fail(rows.lines[i],
              fmt::format("{} {} is not greater than the {} before", rows.first_name, rows.first[i],
                          rows.first[i - 1]),
              "Points stand in the order of time, each once.");
  }
  if (rows.first.front() != 0) {
    rows.fail(rows.lines.front(), fmt::format("{} begins at {}", rows.first_name, rows.first.front()),
              "The first point lies at 0.");
  }
  const double last = rows.first.back();
  if (!time && last != 1) {
    rows.fail(rows.lines.back(), fmt::format("phase ends at {}", last),
              "The last point lies at phase 1 and closes the cycle.");
  }
  std::vector<double> phase = rows.first;
  for (double& value : phase)
    value /= last;
  return phase;
}

/// The second column as parts of its range, closed.
std::vector<double> fractions(const PointsReader& rows, double least, double range) {
  const std::vector<double>& volume = rows.second;
  for (size_t i = 0; i < volume.size(); ++i) {
    if (volume[i] >= least) continue;
    rows.fail(rows.lines[i],
              fmt::format("{} {} lies below the first point's {}", rows.second_name, volume[i], least),
              "A cycle begins at its least volume, at rest: let the file begin at its lowest point.");
  }
  if (std::abs(volume.back() - least) > closure * range) {
    rows.fail(rows.lines.back(),
              fmt::format("ends at {} {}, and began at {}", rows.second_name, volume.back(), least),
              fmt::format("The last point closes the cycle: it has the first one's volume, to {:g}.",
                          closure * range));
  }
  std::vector<double> fraction;
  for (const double value : volume)
    fraction.push_back((value - least) / range);
  fraction.back() = 0;
  return fraction;
}

}  // namespace

PointsFile parse_points(std::string_view text, const std::string& file, PointsOf of) {
  const PointsReader rows(text, file, of);
  PointsFile points;
  points.file = file;
  points.text = std::string(text);
  points.phase = phases(rows);
  const double least = rows.second.front();
  const double range = std::ranges::max(rows.second) - least;
  if (!(range > 0)) {
    rows.fail(rows.lines.back(),
              fmt::format("{} is never above the first point's {}", rows.second_name, least),
              "A waveform moves; use waveform = \"hold\" to stay.");
  }
  points.fraction = fractions(rows, least, range);
  if (rows.second_name == "fraction" && (least != 0 || std::abs(range - 1) > closure)) {
    rows.fail(rows.lines.back(), fmt::format("fraction goes from {} to {}", least, least + range),
              "The least fraction is 0 and the greatest 1: it is the part of stroke_mL.");
  }
  points.line = rows.lines;
  if (rows.first_name == "time_s") points.cycle_s = rows.first.back();
  if (rows.second_name == "volume_mL") points.range_mL = range;
  if (rows.second_name == "pressure_kPa") points.range_kPa = range;
  return points;
}

}  // namespace diastole
