#pragma once
// When each device next wants to be called. A handful of slots, so the earliest is found by looking at all.

#include <cstddef>
#include <vector>

#include "tools/sim_board/core/device.hpp"

namespace diastole::board_model {

class Scheduler {
 public:
  using Slot = std::size_t;

  Slot add(Device& device) {
    entries_.push_back({&device, never});
    return entries_.size() - 1;
  }

  void set(Slot slot, Cycles due) {
    entries_[slot].due = due;
    find_next();
  }

  [[nodiscard]] Cycles next() const { return next_; }

  /// Calls every device that is due at or before `now`, earliest first, each at its own time.
  void run_until(Cycles now) {
    while (next_ <= now) {
      Entry& entry = entries_[next_slot_];
      const Cycles due = entry.due;
      entry.due = never;
      entry.device->on_event(due);
      find_next();
    }
  }

 private:
  struct Entry {
    Device* device;
    Cycles due;
  };

  void find_next() {
    next_ = never;
    for (Slot slot = 0; slot < entries_.size(); ++slot) {
      if (entries_[slot].due < next_) {
        next_ = entries_[slot].due;
        next_slot_ = slot;
      }
    }
  }

  std::vector<Entry> entries_;
  Cycles next_ = never;
  Slot next_slot_ = 0;
};

}  // namespace diastole::board_model
