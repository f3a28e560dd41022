#pragma once
// Which exception runs: pending, enabled and active states, priorities and preemption of the Cortex-M4
// (ARMv7-M ARM, B1.5), with the STM32's 16 levels (upper four priority bits).
//
// Numbers are exception numbers: 2 NMI, 3 HardFault, 4 MemManage, 5 BusFault, 6 UsageFault, 11 SVCall,
// 14 PendSV, 15 SysTick, 16 + n interrupt n. Lower priority values win.

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

  void reset();

  /// A peripheral's interrupt request: a rise makes it pending, a line still high on return does so again.
  /// Peripherals that share a line use different `source` numbers (0 ... 7).
  void set_line(uint32_t irq, bool high, uint32_t source = 0);

  void set_pending(uint32_t number);
  void clear_pending(uint32_t number);
  [[nodiscard]] bool pending(uint32_t number) const { return pending_[number]; }
  [[nodiscard]] bool is_active(uint32_t number) const { return active_[number]; }

  void set_enabled(uint32_t number, bool enabled);
  [[nodiscard]] bool enabled(uint32_t number) const { return enabled_[number]; }

  void set_priority(uint32_t number, uint8_t value);
  [[nodiscard]] uint8_t priority(uint32_t number) const { return static_cast<uint8_t>(priority_[number]); }
  void set_priority_grouping(uint32_t prigroup);
  [[nodiscard]] uint32_t priority_grouping() const { return prigroup_; }

  /// Best pending and enabled exception, 0 for none. `preempts_active` is the cheap test that goes before
  /// reading the masks.
  [[nodiscard]] uint32_t best_pending() const { return best_; }
  [[nodiscard]] bool preempts_active() const { return best_ != 0 && best_group_ < active_group_; }
  [[nodiscard]] bool deliverable(const Masks& masks) const;
  /// WFI ends for it although PRIMASK may keep it from being taken.
  [[nodiscard]] bool wakes(Masks masks) const {
    masks.primask = 0;
    return deliverable(masks);
  }
  /// Whether `number`'s priority lets it be taken now; a fault that cannot be taken escalates.
  [[nodiscard]] bool could_take(uint32_t number, const Masks& masks) const;

  void enter(uint32_t number, uint64_t instructions);
  /// Ends the running exception `number`; false when it was not active (an integrity error of the firmware).
  bool leave(uint32_t number, uint64_t instructions);
  /// The exception being served, 0 in thread mode.
  [[nodiscard]] uint32_t running() const { return running_.empty() ? 0 : running_.back().number; }

  [[nodiscard]] const std::array<InterruptCost, exception_count>& costs() const { return costs_; }

 private:
  struct Running {
    uint32_t number;
    uint64_t start;      ///< instruction count at entry
    uint64_t preempted;  ///< of these, spent in exceptions that preempted it
  };

  [[nodiscard]] int group(int priority) const;
  [[nodiscard]] int execution_priority(const Masks& masks) const;
  void find_best();
  void find_active();

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
