#pragma once
// The rows of /pressure and /pump as a stream of blocks, however long the run is: what the writer brings to the disk.

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "protocol/runfile/run.hpp"

namespace diastole {

/// A dataset of a stream: its path in the file, its unit, and its other attributes.
struct RowColumn {
  std::string path;
  std::string unit;
  std::map<std::string, runfile::Attribute, std::less<>> notes = {};
};

struct RowStream {
  /// The next values of one column; each column's come in order, those of different columns in any.
  using Take = std::function<void(size_t column, std::span<const double> values)>;

  uint64_t rows = 0;  ///< of every column
  std::vector<RowColumn> columns;
  std::function<void(const Take&)> each = [](const Take&) {};
};

}  // namespace diastole
