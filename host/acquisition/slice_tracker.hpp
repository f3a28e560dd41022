#pragma once
// Follows a schedule of slices (host/config/schedule.hpp) cycle by cycle, while the pump goes on.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "host/config/schedule.hpp"

namespace diastole {

class SliceTracker {
 public:
  enum class Phase { waiting, dummy, imaging, pause, done };

  /// Precondition: at least one slice that is not done, each of at least one cycle.
  explicit SliceTracker(std::vector<PlannedSlice> slices) : slices_(std::move(slices)) { enter(next_due(0)); }

  struct Turn {
    bool slice_begins = false;  ///< this cycle is the first that is imaged
    bool last_cycle = false;    ///< this cycle is the last of the study
  };
  /// A cycle begins.
  Turn on_trigger() {
    while (left_ == 0 && phase_ != Phase::waiting && phase_ != Phase::done)
      advance();
    if (phase_ == Phase::waiting || phase_ == Phase::done) return {};
    --left_;
    Turn turn;
    turn.slice_begins = phase_ == Phase::imaging && left_ == planned().cycles - 1;
    turn.last_cycle = phase_ == Phase::imaging && left_ == 0 && next_due(slice_ + 1) == slices_.size();
    if (turn.last_cycle) phase_ = Phase::done;
    return turn;
  }
  /// The operator is ready for a slice; ignored unless it is the one that is waited for.
  void go_on(size_t slice) {
    if (phase_ == Phase::waiting && slice == slice_) phase_ = Phase::dummy;
  }

  [[nodiscard]] Phase phase() const { return phase_; }
  /// The present or coming slice, of all.
  [[nodiscard]] size_t slice() const { return slice_; }
  [[nodiscard]] size_t slices() const { return slices_.size(); }
  [[nodiscard]] const PlannedSlice& planned() const { return slices_[slice_]; }
  /// Cycles that have yet to begin, but for those of waiting.
  [[nodiscard]] int64_t cycles_left() const {
    if (phase_ == Phase::done) return 0;
    const PlannedSlice& now = planned();
    int64_t left = left_;
    if (phase_ == Phase::waiting || phase_ == Phase::dummy) left += now.cycles;
    if (phase_ != Phase::pause) left += now.pause_cycles;
    for (size_t later = next_due(slice_ + 1); later < slices_.size(); later = next_due(later + 1)) {
      const PlannedSlice& planned = slices_[later];
      left += planned.dummy_cycles + planned.cycles + planned.pause_cycles;
    }
    return left;
  }

 private:
  [[nodiscard]] size_t next_due(size_t slice) const {
    while (slice < slices_.size() && slices_[slice].done)
      ++slice;
    return slice;
  }
  void enter(size_t slice) {
    slice_ = slice;
    phase_ = planned().prompt.empty() ? Phase::dummy : Phase::waiting;
    left_ = planned().dummy_cycles;
  }
  void advance() {
    switch (phase_) {
      case Phase::dummy:
        phase_ = Phase::imaging;
        left_ = planned().cycles;
        break;
      case Phase::imaging:
        phase_ = Phase::pause;
        left_ = planned().pause_cycles;
        break;
      case Phase::pause:
        enter(next_due(slice_ + 1));
        break;
      case Phase::waiting:
      case Phase::done:
        break;
    }
  }

  std::vector<PlannedSlice> slices_;
  size_t slice_ = 0;
  Phase phase_ = Phase::dummy;
  int64_t left_ = 0;  // cycles of this phase that have yet to begin
};

inline std::string phase_name(SliceTracker::Phase phase) {
  constexpr std::array names{"waiting", "dummy", "imaging", "pause", "done"};
  return names[static_cast<size_t>(phase)];
}

}  // namespace diastole
