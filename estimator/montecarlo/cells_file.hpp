#pragma once
// The rows of a Monte Carlo table as they come (`NAME.cells.csv`): one line of what was asked, one header, one row a
// cell. Rows are appended whole, so that an interrupted table goes on where it stopped.
//
//   # diastole-cells 1 STUDY seed=1 exact_pressures=0 C_kPa=3 b1=11.09
//   noise_mm,frames,repeat,converged,iterations,seconds,C_kPa,C_kPa_se,b1,b1_se

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/montecarlo/montecarlo.hpp"

namespace diastole {

inline constexpr std::string_view cells_file_mark = "# diastole-cells 1 ";

/// One row without its line feed, and back. `row_of` of a failed cell has empty values.
std::string row_of(const CellResult& result, size_t parameters);
/// Throws std::invalid_argument.
CellResult result_of(const std::string& row, size_t parameters);

/// What a file of cells holds, without its study.
struct SavedTable {
  std::string study;  ///< the study file's name
  bool exact_pressures = false;
  std::vector<TableEntry>
      entries;  ///< by noise, then by number of frames; those of fewer than two refits have no spread
};

inline bool is_cells_file(std::string_view text) { return text.starts_with(cells_file_mark); }
/// Throws InputError if the text is no such file; `file` stands for it in messages.
SavedTable saved_table(const std::string& text, const std::string& file);

class CellsFile {
 public:
  /// Opens or begins the file. Throws InputError if it belongs to another study (its file, mesh or data), seed or truth, or holds a row that
  /// is none; a last row that was cut off in its middle is dropped.
  CellsFile(const std::filesystem::path& path, const Study& study, const MonteCarloPlan& plan);

  [[nodiscard]] const std::vector<CellResult>& results() const { return results_; }
  [[nodiscard]] bool has(const Cell& cell) const;
  /// Throws InputError if the disk refuses.
  void append(const CellResult& result);

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  size_t parameters_;
  std::vector<CellResult> results_;
};

}  // namespace diastole
