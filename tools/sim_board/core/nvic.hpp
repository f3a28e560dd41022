#pragma once
// Which exception runs: pending, enabled and active states, priorities and preemption of the Cortex-M4
// (ARMv7-M ARM, B1.5), with the STM32's 16 levels (upper four priority bits).
//
// Numbers are exception numbers: 2 NMI, 3 HardFault, 4 MemManage, 5 BusFault, 6 UsageFault, 11 SVCall,
// 14 PendSV, 15 SysTick, 16 + n interrupt n. Lower priority values win.

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <vector>

#include "tools/sim_board/core/clock.hpp"

namespace diastole::board_model {

namespace exception {
inline constexpr uint32_t nmi = 2, hard_fault = 3, mem_manage = 4, bus_fault = 5, usage_fault = 6,
                          sv_call = 11, pend_sv = 14, sys_tick = 15, first_irq = 16;
}

inline constexpr uint32_t irq_count = 82;  // STM32F405
inline constexpr uint32_t exception_count = exception::first_irq + irq_count;
inline constexpr int idle_priority = 256;  // nothing active: every priority preempts

/// The registers of the core that hold exceptions back.
struct Masks {
  uint32_t primask = 0, basepri = 0, faultmask = 0;
};

/// What an interrupt's service has cost so far.
struct InterruptCost {
  uint64_t count = 0;
  uint64_t worst_instructions = 0;  ///< entry to return, without what preempted it
  Cycles worst_latency_cycles = 0;  ///< from pending to first instruction
};

class Nvic {
 public:
  explicit Nvic(const Clock& clock) : clock_(clock) { reset(); }

  void reset() {
    pending_.reset();
    enabled_.reset();
    active_.reset();
    lines_.fill(0);
    running_.clear();
    priority_.fill(0);
    priority_[exception::nmi] = -2;
    priority_[exception::hard_fault] = -1;
    for (const uint32_t always : {exception::nmi, exception::hard_fault, exception::sv_call,
                                  exception::pend_sv, exception::sys_tick}) {
      enabled_[always] = true;
    }
    prigroup_ = 0;
    find_best();
    find_active();
  }

  /// A peripheral's interrupt request: a rise makes it pending, a line still high on return does so again.
  /// Peripherals that share a line use different `source` numbers (0 ... 7).
  void set_line(uint32_t irq, bool high, uint32_t source = 0) {
    const uint32_t number = exception::first_irq + irq;
    const auto before = lines_[number];
    const uint32_t bit = 1U << source;
    lines_[number] = static_cast<uint8_t>(high ? before | bit : before & ~bit);
    if (before == 0 && high) set_pending(number);
  }

  void set_pending(uint32_t number) {
    if (!pending_[number]) pending_since_[number] = clock_.now();
    pending_[number] = true;
    find_best();
  }
  void clear_pending(uint32_t number) {
    pending_[number] = lines_[number] != 0;
    find_best();
  }
  [[nodiscard]] bool pending(uint32_t number) const { return pending_[number]; }
  [[nodiscard]] bool is_active(uint32_t number) const { return active_[number]; }

  void set_enabled(uint32_t number, bool enabled) {
    enabled_[number] = enabled;
    find_best();
  }
  [[nodiscard]] bool enabled(uint32_t number) const { return enabled_[number]; }

  void set_priority(uint32_t number, uint8_t value) {
    if (number <= exception::hard_fault) return;
    priority_[number] = value & 0xf0;
    find_best();
    find_active();
  }
  [[nodiscard]] uint8_t priority(uint32_t number) const { return static_cast<uint8_t>(priority_[number]); }
  void set_priority_grouping(uint32_t prigroup) {
    prigroup_ = prigroup & 7;
    find_best();
    find_active();
  }
  [[nodiscard]] uint32_t priority_grouping() const { return prigroup_; }

  /// Best pending and enabled exception, 0 for none. `preempts_active` is the cheap test that goes before
  /// reading the masks.
  [[nodiscard]] uint32_t best_pending() const { return best_; }
  [[nodiscard]] bool preempts_active() const { return best_ != 0 && best_group_ < active_group_; }
  [[nodiscard]] bool deliverable(const Masks& masks) const {
    return best_ != 0 && best_group_ < execution_priority(masks);
  }
  /// WFI ends for it although PRIMASK may keep it from being taken.
  [[nodiscard]] bool wakes(Masks masks) const {
    masks.primask = 0;
    return deliverable(masks);
  }
  /// Whether `number`'s priority lets it be taken now; a fault that cannot be taken escalates.
  [[nodiscard]] bool could_take(uint32_t number, const Masks& masks) const {
    return group(priority_[number]) < execution_priority(masks);
  }

  void enter(uint32_t number, uint64_t instructions) {
    InterruptCost& cost = costs_[number];
    ++cost.count;
    if (pending_[number]) {
      cost.worst_latency_cycles =
          std::max(cost.worst_latency_cycles, clock_.now() - std::min(clock_.now(), pending_since_[number]));
    }
    pending_[number] = false;
    active_[number] = true;
    running_.push_back({number, instructions, 0});
    find_best();
    find_active();
  }
  /// Ends the running exception `number`; false when it was not active (an integrity error of the firmware).
  bool leave(uint32_t number, uint64_t instructions) {
    if (running_.empty() || running_.back().number != number) return false;
    const Running done = running_.back();
    running_.pop_back();
    const uint64_t spent = instructions - done.start;
    InterruptCost& cost = costs_[number];
    cost.worst_instructions = std::max(cost.worst_instructions, spent - done.preempted);
    if (!running_.empty()) running_.back().preempted += spent;
    active_[number] = false;
    if (lines_[number] != 0) set_pending(number);
    find_best();
    find_active();
    return true;
  }
  /// The exception being served, 0 in thread mode.
  [[nodiscard]] uint32_t running() const { return running_.empty() ? 0 : running_.back().number; }

  [[nodiscard]] const std::array<InterruptCost, exception_count>& costs() const { return costs_; }

 private:
  struct Running {
    uint32_t number;
    uint64_t start;      ///< instruction count at entry
    uint64_t preempted;  ///< of these, spent in exceptions that preempted it
  };

  [[nodiscard]] int group(int priority) const {
    return priority < 0 ? priority : priority & ~((2 << prigroup_) - 1);
  }
  [[nodiscard]] int execution_priority(const Masks& masks) const {
    int boundary = active_group_;
    if (masks.basepri & 0xff) boundary = std::min(boundary, group(static_cast<int>(masks.basepri & 0xff)));
    if (masks.primask & 1) boundary = std::min(boundary, 0);
    if (masks.faultmask & 1) boundary = std::min(boundary, -1);
    return boundary;
  }
  void find_best() {
    best_ = 0;
    best_group_ = idle_priority;
    const auto ready = pending_ & enabled_;
    if (ready.none()) return;
    int best_priority = idle_priority;
    for (auto number = static_cast<uint32_t>(ready._Find_first()); number < exception_count;
         number = static_cast<uint32_t>(ready._Find_next(number))) {
      if (priority_[number] < best_priority) {
        best_priority = priority_[number];
        best_ = number;
      }
    }
    best_group_ = group(best_priority);
  }
  void find_active() {
    active_group_ = idle_priority;
    for (const Running& running : running_) {
      active_group_ = std::min(active_group_, group(priority_[running.number]));
    }
  }

  const Clock& clock_;
  std::bitset<exception_count> pending_, enabled_, active_;
  std::array<uint8_t, exception_count> lines_{};  ///< one bit a source that asks
  std::array<int, exception_count> priority_{};
  std::array<Cycles, exception_count> pending_since_{};
  std::array<InterruptCost, exception_count> costs_{};
  std::vector<Running> running_;
  uint32_t prigroup_ = 0;
  uint32_t best_ = 0;
  int best_group_ = idle_priority;
  int active_group_ = idle_priority;
};

}  // namespace diastole::board_model
