#include "estimator/montecarlo/cells_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr size_t fixed_columns = 6;

std::string heading_of(const Study& study, const MonteCarloPlan& plan) {
  std::string first = fmt::format("{}{} seed={} exact_pressures={:d}", cells_file_mark,
                                  study.file.filename().string(), plan.seed, plan.exact_pressures);
  std::string second = "noise_mm,frames,repeat,converged,iterations,seconds";
  for (const StudyParameter& parameter : study.law.parameters) {
    first += fmt::format(" {}={:.10g}", parameter.name, parameter.start);
    second += fmt::format(",{0},{0}_se", parameter.name);
  }
  return first + "\n" + second + "\n";
}

std::vector<std::string> split(const std::string& row) {
  std::vector<std::string> cells(1);
  for (const char c : row) {
    if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

template <class Number>
Number parsed(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size())
    throw std::invalid_argument("\"" + text + "\"");
  return value;
}

}  // namespace

std::string row_of(const CellResult& result, size_t parameters) {
  const Cell& cell = result.cell;
  std::string row = fmt::format("{:g},{},{},{:d},{},{:.3f}", cell.noise_mm, cell.frames, cell.repeat,
                                result.converged, result.iterations, result.seconds);
  for (size_t i = 0; i < parameters; ++i) {
    row +=
        result.converged ? fmt::format(",{:.10g},{:.6g}", result.value[i], result.se[i]) : std::string(",,");
  }
  return row;
}

CellResult result_of(const std::string& row, size_t parameters) {
  const std::vector<std::string> cells = split(row);
  if (cells.size() != fixed_columns + 2 * parameters) throw std::invalid_argument("wrong number of columns");
  CellResult result{{parsed<double>(cells[0]), parsed<int>(cells[1]), parsed<int>(cells[2])},
                    parsed<int>(cells[3]) != 0,
                    parsed<int>(cells[4]),
                    parsed<double>(cells[5]),
                    {},
                    {}};
  for (size_t i = 0; result.converged && i < parameters; ++i) {
    result.value.push_back(parsed<double>(cells[fixed_columns + 2 * i]));
    result.se.push_back(parsed<double>(cells[fixed_columns + 2 * i + 1]));
  }
  return result;
}

CellsFile::CellsFile(const std::filesystem::path& path, const Study& study, const MonteCarloPlan& plan)
    : path_(path), parameters_(study.law.parameters.size()) {
  const std::string heading = heading_of(study, plan);
  std::string kept = heading;
  if (std::filesystem::exists(path)) {
    const std::string text = read_whole_file(path);
    if (!text.starts_with(heading)) {
      throw InputError({path.string(), "line 1", "belongs to another study, seed or truth",
                        "Choose another file, or remove this one to begin anew."});
    }
    size_t line = 2, begin = heading.size();
    for (size_t end = text.find('\n', begin); end != std::string::npos; end = text.find('\n', begin)) {
      ++line;
      const std::string row = text.substr(begin, end - begin);
      try {
        results_.push_back(result_of(row, parameters_));
      } catch (const std::invalid_argument& error) {
        throw InputError({path.string(), fmt::format("line {}", line),
                          fmt::format("is no cell: {}", error.what()),
                          "Remove the line; its cell is then fitted again."});
      }
      kept += row + "\n";
      begin = end + 1;
    }
  }
  write_whole_file(path, kept);
  file_.open(path, std::ios::app);
}

bool CellsFile::has(const Cell& cell) const {
  return std::any_of(results_.begin(), results_.end(),
                     [&](const CellResult& result) { return result.cell == cell; });
}

void CellsFile::append(const CellResult& result) {
  results_.push_back(result);
  file_ << row_of(result, parameters_) + "\n" << std::flush;
  if (!file_)
    throw InputError({path_.string(), "", "cannot be written", "Make room, or choose another place."});
}

}  // namespace diastole
