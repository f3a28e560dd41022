#pragma once
// The recorded phantom-a with every fourth of its tag points, in a folder of its own, for tests to spoil.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::test {

/// A CSV file of numbers, by row and column.
struct CsvNumbers {
  std::string header;
  std::vector<std::vector<double>> rows;

  static CsvNumbers read(const std::filesystem::path& file) {
    std::ifstream stream(file);
    CsvNumbers csv;
    std::getline(stream, csv.header);
    for (std::string line; std::getline(stream, line);) {
      std::istringstream cells(line);
      std::vector<double>& row = csv.rows.emplace_back();
      for (std::string cell; std::getline(cells, cell, ',');)
        row.push_back(std::stod(cell));
    }
    return csv;
  }

  [[nodiscard]] std::string text() const {
    std::string text = header + "\n";
    for (const std::vector<double>& row : rows)
      text += fmt::format("{}\n", fmt::join(row, ","));
    return text;
  }
};

class ThinnedPhantom {
 public:
  // Columns of the two files.
  static constexpr size_t frame = 0, normal = 1, plane = 4, place = 5, pressure = 2;

  ThinnedPhantom() {
    CsvNumbers all = CsvNumbers::read(examples_ + "phantom-a.tags.csv");
    constexpr size_t every = 4;
    tags.header = all.header;
    for (size_t i = 0; i < all.rows.size(); i += every)
      tags.rows.push_back(std::move(all.rows[i]));
  }

  CsvNumbers tags;
  CsvNumbers frames = CsvNumbers::read(examples_ + "phantom-a.frames.csv");

  /// Writes the files as they are now; answers the study.
  [[nodiscard]] std::string study() const {
    folder_.write("phantom-a.tags.csv", tags.text());
    folder_.write("phantom-a.frames.csv", frames.text());
    return folder_.write("phantom-a.study.toml", read_whole_file(examples_ + "phantom-a.study.toml"))
        .string();
  }

  [[nodiscard]] std::string file(const char* name) const { return (folder_.path() / name).string(); }

 private:
  inline static const std::string examples_ = DIASTOLE_SOURCE_DIR "/examples/";
  ScratchFolder folder_;
};

}  // namespace diastole::test
