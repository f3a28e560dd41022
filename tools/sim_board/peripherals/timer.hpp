#pragma once
// Timers TIM1 ... TIM14: up-counting with prescaler and auto-reload, compare channels with their output
// modes, preload registers, update generation, one-pulse mode, trigger output and the slave modes reset,
// trigger and external clock 1 (RM0090, 17-19).
//
// The counter is a function of time. Whatever happens at a count (update, compare match) is worked out in
// order when time reaches it or when a register is looked at, so edges are exact to the timer's clock.

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Timer final : public RegisterBlock {
 public:
  static constexpr uint32_t channel_count = 4;

  struct Shape {
    uint8_t number = 2;
    bool wide = false;  ///< 32-bit counter (TIM2, TIM5)
    bool on_apb2 = false;
    uint32_t update_irq = 28, compare_irq = 28;
    uint32_t line_source = 0;  ///< 1 for the second timer on a shared interrupt line
  };

  /// Where the timer's signals go.
  struct Wiring {
    std::function<void(uint8_t channel, bool level, Cycles at)> output;
    std::function<void(Cycles at)> trigger_output;
    /// A compare value was written that the counter has already passed: the edge comes a whole turn late.
    std::function<void(uint8_t channel, Cycles late_by)> missed;
  };

  Timer(Shape shape, const Clock& clock, Scheduler& scheduler, Nvic& nvic, Notes& notes);
  void wire(Wiring wiring) { wiring_ = std::move(wiring); }

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;
  void on_event(Cycles at) override;
  void before_clock_change() override { settle(clock_.now()); }
  void after_clock_change() override;

  /// A trigger from another timer on internal trigger input `input` (0 ... 3).
  void internal_trigger(uint32_t input, Cycles at);
  [[nodiscard]] const Shape& shape() const { return shape_; }

 private:
  uint32_t* word(uint32_t offset) override;
  struct Channel {
    uint32_t compare = 0;    ///< the value in force
    uint32_t preload = 0;    ///< the value in CCRx
    bool reference = false;  ///< OCxREF
    bool output = false;     ///< level at the pin
  };

  [[nodiscard]] bool counting() const { return (cr1_ & 1) != 0 && reload_ != 0 && !external_clock(); }
  [[nodiscard]] bool external_clock() const { return (smcr_ & 7) == 7; }
  [[nodiscard]] Cycles cycles_per_count() const;
  [[nodiscard]] uint64_t top() const { return uint64_t{reload_} + 1; }
  [[nodiscard]] uint32_t width_mask() const { return shape_.wide ? 0xffff'ffff : 0xffff; }
  [[nodiscard]] uint32_t output_mode(uint32_t channel) const;
  [[nodiscard]] bool preloaded(uint32_t channel) const;
  [[nodiscard]] uint64_t counts_to_match(uint32_t channel) const;
  [[nodiscard]] uint64_t counts_to_update() const;
  [[nodiscard]] bool match_observable(uint32_t channel) const;
  [[nodiscard]] bool update_observable() const;
  [[nodiscard]] uint32_t trigger_mode() const { return cr2_ >> 4 & 7; }

  void settle(Cycles to);
  void advance_count(uint64_t counts, Cycles at);
  void happen(Cycles at);
  void update_event(Cycles at, bool by_overflow);
  void match(uint32_t channel, Cycles at);
  void set_reference(uint32_t channel, bool active, Cycles at);
  void set_outputs(Cycles at);
  void apply_forced_modes(Cycles at);
  void write_compare(uint32_t channel, uint32_t value);
  void write_slave_mode(uint32_t value);
  void write_control(uint32_t value);
  void generate(uint32_t bits, Cycles at);
  void set_lines();
  void ask();
  void unmodelled(const char* what);

  Shape shape_;
  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Notes& notes_;
  Scheduler::Slot slot_;
  Wiring wiring_;

  uint32_t cr1_ = 0, cr2_ = 0, smcr_ = 0, dier_ = 0, sr_ = 0, ccer_ = 0, bdtr_ = 0, rcr_ = 0;
  std::array<uint32_t, 2> ccmr_{};
  uint32_t prescaler_ = 0, prescaler_preload_ = 0;
  uint32_t reload_ = 0, reload_preload_ = 0;
  std::array<Channel, channel_count> channels_{};
  uint32_t count_ = 0;
  Cycles count_since_ = 0;  ///< when the counter took the value `count_`
};

}  // namespace diastole::board_model
