#include "protocol/runfile/spacing.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "protocol/signal/median.hpp"

namespace diastole::runfile {
namespace {

constexpr size_t rows_around = 8;
constexpr double hole_spacings_before_last = 1.1;  // no row follows the last to distinguish late from shifted

constexpr size_t most_median_steps = size_t{1} << 17;

double median_step_s(const Series& time_s) {
  if (time_s.size() < 2) return 0;
  const size_t stride = (time_s.size() - 2) / most_median_steps + 1;
  std::vector<double> steps_s;
  steps_s.reserve((time_s.size() - 2) / stride + 1);
  double last_s = 0;
  time_s.each_block([&](size_t first, std::span<const double> block) {
    for (size_t i = 0; i < block.size(); last_s = block[i++])
      if (first + i > 0 && (first + i - 1) % stride == 0) steps_s.push_back(block[i] - last_s);
  });
  return signal::median(std::move(steps_s));
}

/// Goes from row to row with those around it at hand.
class RowsInOrder {
 public:
  RowsInOrder(size_t rows, Spacing& spacing) : rows_(rows), spacing_(spacing) {}

  void take(std::span<const double> block) {
    kept_s_.insert(kept_s_.end(), block.begin(), block.end());
    const size_t end = first_kept_ + kept_s_.size();
    for (; next_ < end && (end == rows_ || next_ + rows_around <= end); ++next_)
      look_at(next_);
    if (next_ <= first_kept_ + rows_around) return;
    const size_t done = next_ - rows_around - first_kept_;
    kept_s_.erase(kept_s_.begin(), kept_s_.begin() + static_cast<std::ptrdiff_t>(done));
    first_kept_ += done;
  }

 private:
  void look_at(size_t row) {
    const double step_s = at(row) - at(row - 1);
    spacing_.irregularity.longest_ms = std::max(spacing_.irregularity.longest_ms, 1e3 * step_s);
    if (step_s > irregular_spacings * spacing_.median_s) ++spacing_.irregularity.steps;
    if (step_s <= spacing_.median_s) return;
    const size_t before = row - std::min(rows_around, row - since_);
    const double shift_s =
        least_phase_s(row, std::min(row + rows_around, rows_)) - least_phase_s(before, row);
    const double bound = row + 1 == rows_ ? hole_spacings_before_last : hole_spacings;
    if (shift_s < bound * spacing_.median_s) return;
    spacing_.holes.push_back({row, at(row - 1), at(row)});
    since_ = row;
  }
  /// Least phase of rows [first, last).
  [[nodiscard]] double least_phase_s(size_t first, size_t last) const {
    double least_s = std::numeric_limits<double>::max();
    for (size_t i = first; i < last; ++i)
      least_s = std::min(least_s, at(i) - static_cast<double>(i) * spacing_.median_s);
    return least_s;
  }
  [[nodiscard]] double at(size_t row) const { return kept_s_[row - first_kept_]; }

  size_t rows_;
  Spacing& spacing_;
  std::vector<double> kept_s_;
  size_t first_kept_ = 0;
  size_t next_ = 1;
  size_t since_ = 0;  // the last hole
};

}  // namespace

Spacing spacing_of(const Series& time_s) {
  Spacing spacing;
  spacing.median_s = median_step_s(time_s);
  RowsInOrder rows(time_s.size(), spacing);
  time_s.each_block([&](size_t first, std::span<const double> block) {
    if (first == 0) spacing.first_s = block.front();
    spacing.last_s = block.back();
    rows.take(block);
  });
  return spacing;
}

}  // namespace diastole::runfile
