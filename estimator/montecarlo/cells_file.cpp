#include "estimator/montecarlo/cells_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/split.hpp>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "estimator/io/study_fingerprint.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

constexpr size_t fixed_columns = 6;

std::string body_words(const MonteCarloPlan& plan) { return plan.unload ? "+unloaded" : ""; }

std::string grid_words(const MonteCarloPlan& plan) {
  if (!plan.grid) return "";
  return fmt::format("+{}-{}-{}-{}", plan.grid->stripe_mm, plan.grid->pixel_mm, plan.grid->short_axis_images,
                     plan.grid->long_axis_images);
}

std::string heading_of(const Study& study, const MonteCarloPlan& plan) {
  std::string first = fmt::format("{}{}#{}{}{} seed={} exact_pressures={:d}", cells_file_mark,
                                  study.file.filename().string(), study_fingerprint(study), body_words(plan),
                                  grid_words(plan), plan.seed, plan.exact_pressures);
  std::string second = "noise_mm,frames,repeat,converged,iterations,seconds";
  for (const StudyParameter& parameter : study.law.parameters) {
    first += fmt::format(" {}={:.10g}", parameter.name, parameter.start);
    second += fmt::format(",{0},{0}_se", parameter.name);
  }
  return first + "\n" + second + "\n";
}

template <class Number>
Number parsed(const std::string& text) {
  const auto value = parse_number<Number>(text);
  if (!value) throw std::invalid_argument("\"" + text + "\"");
  return *value;
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
  std::vector<std::string> cells;
  boost::split(cells, row, [](char c) { return c == ','; });
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

namespace {

/// The rows behind the two lines of the heading; a last one that was cut off is dropped.
std::vector<CellResult> read_rows(const std::string& text, size_t begin, size_t parameters,
                                  const std::string& file) {
  std::vector<CellResult> results;
  size_t line = 2;
  for (size_t end = text.find('\n', begin); end != std::string::npos; end = text.find('\n', begin)) {
    ++line;
    try {
      results.push_back(result_of(text.substr(begin, end - begin), parameters));
    } catch (const std::invalid_argument& error) {
      throw InputError({file, fmt::format("line {}", line), fmt::format("is no cell: {}", error.what()),
                        "Remove the line; its cell is then fitted again."});
    }
    begin = end + 1;
  }
  return results;
}

/// "C_kPa=3" as a parameter whose true value that is.
StudyParameter truth_of(const std::string& word) {
  const size_t equals = word.find('=');
  if (equals == std::string::npos) throw std::invalid_argument("\"" + word + "\"");
  const double truth = parsed<double>(word.substr(equals + 1));
  return {word.substr(0, equals), truth, truth > 0 ? 0.5 * truth : -std::abs(truth), std::abs(truth),
          Variation::whole};
}

}  // namespace

SavedTable saved_table(const std::string& text, const std::string& file) {
  const InputError no_table({file, "line 1", "is no file of Monte Carlo cells",
                             "Give one that `diastole montecarlo --cells NAME.cells.csv` wrote."});
  const size_t first_end = text.find('\n');
  const size_t second_end = first_end == std::string::npos ? first_end : text.find('\n', first_end + 1);
  if (!is_cells_file(text) || second_end == std::string::npos) throw no_table;
  SavedTable saved;
  Study study{};
  MonteCarloPlan plan;
  plan.noise_mm.clear();
  std::istringstream words(text.substr(cells_file_mark.size(), first_end - cells_file_mark.size()));
  std::string seed, exact;
  words >> saved.study >> seed >> exact;
  saved.study.erase(std::min(saved.study.find('#'), saved.study.size()));  // without its fingerprint
  saved.exact_pressures = exact.ends_with("=1");
  try {
    for (std::string word; words >> word;)
      study.law.parameters.push_back(truth_of(word));
  } catch (const std::invalid_argument&) {
    throw no_table;
  }
  const std::vector<CellResult> results = read_rows(text, second_end + 1, study.law.parameters.size(), file);
  plan.repeats = 0;
  for (const CellResult& result : results) {
    plan.repeats = std::max(plan.repeats, result.cell.repeat);
    if (std::find(plan.noise_mm.begin(), plan.noise_mm.end(), result.cell.noise_mm) == plan.noise_mm.end())
      plan.noise_mm.push_back(result.cell.noise_mm);
    if (std::find(plan.frames.begin(), plan.frames.end(), result.cell.frames) == plan.frames.end())
      plan.frames.push_back(result.cell.frames);
  }
  std::sort(plan.noise_mm.begin(), plan.noise_mm.end());
  std::sort(plan.frames.begin(), plan.frames.end());
  saved.entries = table_of(plan, study, results);
  return saved;
}

CellsFile::CellsFile(const std::filesystem::path& path, const Study& study, const MonteCarloPlan& plan)
    : path_(path), parameters_(study.law.parameters.size()) {
  const std::string heading = heading_of(study, plan);
  std::string kept = heading;
  if (std::filesystem::exists(path)) {
    std::string text = read_whole_file(path);
    if (text.empty()) text = heading;
    if (!text.starts_with(heading)) {
      throw InputError({path.string(), "line 1", "belongs to another study, mesh, data, seed or truth",
                        "Choose another file, or remove this one to begin anew."});
    }
    results_ = read_rows(text, heading.size(), parameters_, path.string());
    for (const CellResult& result : results_)
      kept += row_of(result, parameters_) + "\n";
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
