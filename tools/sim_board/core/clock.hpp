#pragma once
// Virtual time: core clock cycles since power-up, and what they are in nanoseconds. One instruction is one
// cycle. When the firmware switches clocks the scale changes and the past keeps its meaning.

#include <cstdint>
#include <limits>

namespace diastole::board_model {

using Cycles = uint64_t;
inline constexpr Cycles never = std::numeric_limits<Cycles>::max();

/// Rates that follow from RCC's registers; ratios are core cycles per cycle of the bus or timer kernel.
struct ClockTree {
  uint32_t core_Hz = 16'000'000;
  uint32_t apb1_ratio = 1, apb2_ratio = 1;
  uint32_t apb1_timer_ratio = 1, apb2_timer_ratio = 1;
  bool operator==(const ClockTree&) const = default;
};

class Clock {
 public:
  /// Start of the block of instructions being executed; register accesses happen at this time.
  [[nodiscard]] Cycles now() const { return now_; }
  void set_now(Cycles cycle) { now_ = cycle; }

  [[nodiscard]] const ClockTree& tree() const { return tree_; }
  void set_tree(const ClockTree& tree) {
    anchor_ps_ = picoseconds(now_);
    anchor_ = now_;
    tree_ = tree;
  }

  /// Nanoseconds since power-up, rounded to nearest; `cycle` not before the latest change of clocks.
  [[nodiscard]] uint64_t ns(Cycles cycle) const {
    return static_cast<uint64_t>((picoseconds(cycle) + 500) / 1000);
  }

  /// First cycle at or after `time_ns`; `never` stays never.
  [[nodiscard]] Cycles cycle_at(uint64_t time_ns) const {
    if (time_ns == std::numeric_limits<uint64_t>::max()) return never;
    const Wide time_ps = Wide{time_ns} * 1000;
    if (time_ps <= anchor_ps_) return anchor_;
    const Wide scaled = (time_ps - anchor_ps_) * tree_.core_Hz;
    return anchor_ + static_cast<Cycles>((scaled + per_second - 1) / per_second);
  }

  [[nodiscard]] Cycles cycles_in(uint64_t duration_ns) const {
    return static_cast<Cycles>((Wide{duration_ns} * tree_.core_Hz + 999'999'999) / 1'000'000'000);
  }

 private:
  using Wide = unsigned __int128;
  static constexpr Wide per_second = 1'000'000'000'000;

  [[nodiscard]] Wide picoseconds(Cycles cycle) const {
    const Cycles since = cycle > anchor_ ? cycle - anchor_ : 0;
    return anchor_ps_ + Wide{since} * per_second / tree_.core_Hz;
  }

  Cycles now_ = 0;
  Cycles anchor_ = 0;
  Wide anchor_ps_ = 0;
  ClockTree tree_;
};

}  // namespace diastole::board_model
