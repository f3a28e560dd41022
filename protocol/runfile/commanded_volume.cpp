#include "protocol/runfile/commanded_volume.hpp"

#include <algorithm>
#include <limits>

namespace diastole::runfile {

CommandedVolume::CommandedVolume(const StreamRows& pump)
    : time_s_(pump.time_s), volume_mL_(pump.values.at("commanded_mL")) {}

double CommandedVolume::at(double time_s) {
  while (next_ > 0 && row(next_ - 1).time_s >= time_s)
    --next_;
  while (next_ < time_s_.size() && row(next_).time_s < time_s)
    ++next_;
  if (next_ == time_s_.size()) return std::numeric_limits<double>::quiet_NaN();
  const Row after = row(next_);
  if (after.time_s == time_s) return after.volume_mL;
  if (next_ == 0) return std::numeric_limits<double>::quiet_NaN();
  const Row before = row(next_ - 1);
  const double part = (time_s - before.time_s) / (after.time_s - before.time_s);
  return before.volume_mL + part * (after.volume_mL - before.volume_mL);  // std::lerp makes a number of NaN
}

CommandedVolume::Row CommandedVolume::row(size_t row) {
  if (row < first_ || row >= first_ + block_s_.size()) {
    // Its neighbours are asked for, too.
    first_ = row - std::min(row, Series::block_rows / 2);
    const size_t count = std::min(Series::block_rows, time_s_.size() - first_);
    block_s_ = time_s_.rows(first_, count, memory_s_);
    block_mL_ = volume_mL_.rows(first_, count, memory_mL_);
  }
  return {block_s_[row - first_], block_mL_[row - first_]};
}

}  // namespace diastole::runfile
