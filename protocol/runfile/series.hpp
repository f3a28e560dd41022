#pragma once
// One column of numbers, in memory or in a file, read block by block.

#include <algorithm>
#include <cstddef>
#include <functional>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

namespace diastole::runfile {

class Series {
 public:
  /// Fills `values` with the rows from `first` on.
  using Read = std::function<void(size_t first, std::span<double> values)>;

  Series() = default;
  Series(size_t rows, Read read) : rows_(rows), read_(std::move(read)) {}
  /// Of memory that outlives it.
  Series(const std::vector<double>& values) : rows_(values.size()), memory_(values) {}

  [[nodiscard]] size_t size() const { return rows_; }
  /// Hands over all rows in order: take(first row, values).
  template <typename Take>
  void each_block(const Take& take) const {
    std::vector<double> block;
    for (size_t first = 0; first < rows_; first += block_rows) {
      const size_t count = std::min(block_rows, rows_ - first);
      take(first, rows(first, count, block));
    }
  }
  /// Rows [first, first + count), which must be there; `memory` holds those of a file.
  [[nodiscard]] std::span<const double> rows(size_t first, size_t count, std::vector<double>& memory) const {
    if (!read_) return memory_.subspan(first, count);
    memory.resize(count);
    read_(first, memory);
    return memory;
  }

  /// Precondition of these three: the row is there.
  [[nodiscard]] double at(size_t row) const {
    std::vector<double> memory;
    return rows(row, 1, memory)[0];
  }
  [[nodiscard]] double front() const { return at(0); }
  [[nodiscard]] double back() const { return at(rows_ - 1); }

  static constexpr size_t block_rows = 16384;

 private:
  size_t rows_ = 0;
  Read read_;
  std::span<const double> memory_;
};

/// Hands over the first `rows` rows of columns side by side, in order: take(first row, a span of each column). Each must have as many.
template <typename Take>
void each_block_of(std::initializer_list<const Series*> columns, size_t rows, const Take& take) {
  std::vector<std::vector<double>> memory(columns.size());
  std::vector<std::span<const double>> block(columns.size());
  for (size_t first = 0; first < rows; first += Series::block_rows) {
    const size_t count = std::min(Series::block_rows, rows - first);
    for (size_t i = 0; i < columns.size(); ++i)
      block[i] = columns.begin()[i]->rows(first, count, memory[i]);
    take(first, block);
  }
}

}  // namespace diastole::runfile
