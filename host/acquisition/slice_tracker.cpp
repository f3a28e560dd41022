#include "host/acquisition/slice_tracker.hpp"

namespace diastole {

SliceTracker::SliceTracker(std::vector<PlannedSlice> slices) : slices_(std::move(slices)) { enter(0); }

void SliceTracker::enter(size_t slice) {
  slice_ = slice;
  phase_ = planned().prompt.empty() ? Phase::dummy : Phase::waiting;
  left_ = planned().dummy_cycles;
}

void SliceTracker::advance() {
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
      enter(slice_ + 1);
      break;
    case Phase::waiting:
    case Phase::done:
      break;
  }
}

SliceTracker::Turn SliceTracker::on_trigger() {
  while (left_ == 0 && phase_ != Phase::waiting && phase_ != Phase::done)
    advance();
  if (phase_ == Phase::waiting || phase_ == Phase::done) return {};
  --left_;
  Turn turn;
  turn.slice_begins = phase_ == Phase::imaging && left_ == planned().cycles - 1;
  turn.last_cycle = phase_ == Phase::imaging && left_ == 0 && slice_ + 1 == slices_.size();
  if (turn.last_cycle) phase_ = Phase::done;
  return turn;
}

void SliceTracker::go_on(size_t slice) {
  if (phase_ == Phase::waiting && slice == slice_) phase_ = Phase::dummy;
}

int64_t SliceTracker::cycles_left() const {
  if (phase_ == Phase::done) return 0;
  const PlannedSlice& now = planned();
  int64_t left = left_;
  if (phase_ == Phase::waiting || phase_ == Phase::dummy) left += now.cycles;
  if (phase_ != Phase::pause) left += now.pause_cycles;
  for (size_t later = slice_ + 1; later < slices_.size(); ++later) {
    const PlannedSlice& planned = slices_[later];
    left += planned.dummy_cycles + planned.cycles + planned.pause_cycles;
  }
  return left;
}

std::string phase_name(SliceTracker::Phase phase) {
  switch (phase) {
    case SliceTracker::Phase::waiting:
      return "waiting";
    case SliceTracker::Phase::dummy:
      return "dummy";
    case SliceTracker::Phase::imaging:
      return "imaging";
    case SliceTracker::Phase::pause:
      return "pause";
    case SliceTracker::Phase::done:
      break;
  }
  return "done";
}

}  // namespace diastole
