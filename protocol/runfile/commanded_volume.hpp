#pragma once
// The volume that the pump was commanded to, at any time.

#include <span>
#include <vector>

#include "protocol/runfile/stream_rows.hpp"

namespace diastole::runfile {

/// Asked at times that mostly increase it goes through the rows once, a block at a time.
class CommandedVolume {
 public:
  /// `pump` outlives it.
  explicit CommandedVolume(const StreamRows& pump);
  /// Straight between two rows, mL; NaN before the first, behind the last and beside a missing position.
  double at(double time_s);

 private:
  struct Row {
    double time_s;
    double volume_mL;
  };
  /// Precondition: `row` is there.
  Row row(size_t row);

  const Series& time_s_;
  const Series& volume_mL_;
  size_t next_ = 0;   ///< the first row not before what was asked last
  size_t first_ = 0;  ///< of the block
  std::span<const double> block_s_, block_mL_;
  std::vector<double> memory_s_, memory_mL_;
};

}  // namespace diastole::runfile
