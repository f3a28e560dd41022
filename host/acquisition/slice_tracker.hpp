#pragma once
// Follows a schedule of slices (host/config/schedule.hpp) cycle by cycle, while the pump goes on.

#include <cstddef>
#include <string>
#include <vector>

#include "host/config/schedule.hpp"

namespace diastole {

class SliceTracker {
 public:
  enum class Phase { waiting, dummy, imaging, pause, done };

  /// Precondition: at least one slice, each of at least one cycle.
  explicit SliceTracker(std::vector<PlannedSlice> slices);

  struct Turn {
    bool slice_begins = false;  ///< this cycle is the first that is imaged
    bool last_cycle = false;    ///< this cycle is the last of the study
  };
  /// A cycle begins.
  Turn on_trigger();
  /// The operator is ready for a slice; ignored unless it is the one that is waited for.
  void go_on(size_t slice);

  [[nodiscard]] Phase phase() const { return phase_; }
  /// The present or coming slice, of all.
  [[nodiscard]] size_t slice() const { return slice_; }
  [[nodiscard]] size_t slices() const { return slices_.size(); }
  [[nodiscard]] const PlannedSlice& planned() const { return slices_[slice_]; }
  /// Cycles that have yet to begin, but for those of waiting.
  [[nodiscard]] int64_t cycles_left() const;

 private:
  void enter(size_t slice);
  void advance();

  std::vector<PlannedSlice> slices_;
  size_t slice_ = 0;
  Phase phase_ = Phase::dummy;
  int64_t left_ = 0;  // cycles of this phase that have yet to begin
};

std::string phase_name(SliceTracker::Phase phase);

}  // namespace diastole
