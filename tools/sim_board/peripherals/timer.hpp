#pragma once
// Timers TIM1 ... TIM14: up-counting with prescaler and auto-reload, compare channels with their output
// modes, preload registers, update generation, one-pulse mode, trigger output and the slave modes reset,
// trigger and external clock 1, by an internal trigger or the timer's own second input (RM0090, 17-19). Capture: of a channel's
// own pin (CCxS = 1), of the internal trigger (CCxS = 3), and of TIM11's channel 1 from the crystal (TIM11_OR).
//
// The counter is a function of time. Whatever happens at a count (update, compare match) is worked out in
// order when time reaches it or when a register is looked at, so edges are exact to the timer's clock.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>

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
    /// A channel becomes an input (CCxS), or an output again.
    std::function<void(uint8_t channel, bool input, Cycles at)> direction;
    /// A compare value was written that the counter has already passed: the edge comes a whole turn late.
    std::function<void(uint8_t channel, Cycles late_by)> missed;
    /// TIM11 only: core cycles between edges of the divided crystal, 0 without.
    std::function<double()> crystal_edges = {};
  };

  Timer(Shape shape, const Clock& clock, Scheduler& scheduler, Nvic& nvic, Notes& notes)
      : shape_(shape),
        clock_(clock),
        scheduler_(scheduler),
        nvic_(nvic),
        notes_(notes),
        slot_(scheduler.add(*this)) {
    reset();
  }
  void wire(Wiring wiring) { wiring_ = std::move(wiring); }

  std::optional<uint32_t> read(uint32_t offset) override {
    settle(clock_.now());
    capture_crystal(clock_.now());
    const bool reads_capture = offset >= 0x34 && offset <= 0x40 && input((offset - 0x34) / 4) != 0;
    if (reads_capture) sr_ &= ~compare_flag((offset - 0x34) / 4);
    return RegisterBlock::read(offset);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    const Cycles now = clock_.now();
    settle(now);
    switch (offset) {
      case 0x00:
        write_control(merged(cr1_, value, mask));
        break;
      case 0x08:
        write_slave_mode(merged(smcr_, value, mask));
        break;
      case 0x10:
        sr_ &= value | ~mask;
        break;
      case 0x14:
        generate(value & mask, now);
        break;
      case 0x24:
        count_ = merged(count_, value, mask) & width_mask();
        count_since_ = now;
        break;
      case 0x2c:
        reload_preload_ = merged(reload_preload_, value, mask) & width_mask();
        if ((cr1_ & auto_reload_preload) == 0) reload_ = reload_preload_;
        break;
      case 0x34:
      case 0x38:
      case 0x3c:
      case 0x40:
        write_compare((offset - 0x34) / 4, merged(*word(offset), value, mask) & width_mask());
        break;
      default:
        RegisterBlock::write(offset, value, mask);
        if (offset == 0x18 || offset == 0x1c) set_directions(now), apply_forced_modes(now);
        prescaler_preload_ &= 0xffff;
        if (offset == 0x30 && rcr_ != 0) unmodelled("the repetition counter");
        break;
    }
    set_outputs(now);
    set_lines();
    ask();
  }
  void reset() override {
    cr1_ = cr2_ = smcr_ = dier_ = sr_ = ccer_ = bdtr_ = rcr_ = dcr_ = dmar_ = or_ = 0;
    ccmr_.fill(0);
    prescaler_ = prescaler_preload_ = 0;
    reload_ = reload_preload_ = width_mask();
    count_ = 0;
    count_since_ = clock_.now();
    for (Channel& channel : channels_) {
      channel.compare = channel.preload = 0;
      channel.reference = false;
    }
    set_directions(clock_.now());
    set_outputs(clock_.now());
    set_lines();
    ask();
  }
  void on_event(Cycles at) override {
    settle(at);
    ask();
  }
  void before_clock_change() override { settle(clock_.now()); }
  void after_clock_change() override { ask(); }

  /// A trigger from another timer on internal trigger input `input` (0 ... 3).
  void internal_trigger(uint32_t input, Cycles at) {
    const uint32_t mode = smcr_ & 7;
    if ((smcr_ >> 4 & 7) != input) return;
    settle(at);
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      if (this->input(channel) == from_trigger && (ccer_ >> (4 * channel) & 1) != 0) capture(channel, count_);
    }
    if (mode == 0) return set_lines();
    switch (mode) {
      case slave_reset:
        generate(update_flag, at);
        break;
      case slave_trigger:
        cr1_ |= 1;
        break;
      case slave_clock:
        if ((cr1_ & 1) != 0) advance_count(1, at);
        break;
      default:
        unmodelled("slave mode");
        break;
    }
    sr_ |= trigger_flag;
    set_lines();
    ask();
  }
  /// An edge at the pin of channel `channel` (0 ... 3), with the alternate function that leads to it.
  void pin_edge(uint32_t channel, bool rises, Cycles at) {
    const uint32_t enable = ccer_ >> (4 * channel);
    if (rises == ((enable >> 1 & 1) != 0) || or_ != 0) return;  // CCxP
    settle(at);
    if (input(channel) == from_own_pin && (enable & 1) != 0) capture(channel, count_);
    constexpr uint32_t second_input = 6;
    if (channel == 1 && external_clock() && (smcr_ >> 4 & 7) == second_input && (cr1_ & 1) != 0)
      advance_count(1, at);
    set_lines();
    ask();
  }
  [[nodiscard]] const Shape& shape() const { return shape_; }

 private:
  static constexpr uint32_t update_flag = 1, trigger_flag = 1 << 6;
  static constexpr uint32_t auto_reload_preload = 1 << 7, one_pulse = 1 << 3, update_request_source = 1 << 2,
                            update_disable = 1 << 1;

  static uint32_t compare_flag(uint32_t channel) { return 2U << channel; }

  enum OutputMode : uint32_t {
    frozen,
    active_on_match,
    inactive_on_match,
    toggle,
    force_inactive,
    force_active,
    pwm1,
    pwm2
  };
  enum TriggerMode : uint32_t { on_reset, on_enable, on_update, on_compare_pulse };
  enum SlaveMode : uint32_t { slave_reset = 4, slave_trigger = 6, slave_clock = 7 };

  uint32_t* word(uint32_t offset) override {
    return in_order(offset, {&cr1_,
                             &cr2_,
                             &smcr_,
                             &dier_,
                             &sr_,
                             nullptr,
                             &ccmr_[0],
                             &ccmr_[1],
                             &ccer_,
                             &count_,
                             &prescaler_preload_,
                             &reload_preload_,
                             &rcr_,
                             &channels_[0].preload,
                             &channels_[1].preload,
                             &channels_[2].preload,
                             &channels_[3].preload,
                             &bdtr_,
                             &dcr_,
                             &dmar_,
                             &or_});
  }
  struct Channel {
    uint32_t compare = 0;    ///< the value in force
    uint32_t preload = 0;    ///< the value in CCRx
    bool reference = false;  ///< OCxREF
    bool output = false;     ///< level at the pin
    bool is_input = false;   ///< CCxS
  };

  [[nodiscard]] bool counting() const { return (cr1_ & 1) != 0 && reload_ != 0 && !external_clock(); }
  [[nodiscard]] bool external_clock() const { return (smcr_ & 7) == 7; }
  [[nodiscard]] Cycles cycles_per_count() const {
    const ClockTree& tree = clock_.tree();
    return Cycles{shape_.on_apb2 ? tree.apb2_timer_ratio : tree.apb1_timer_ratio} *
           (uint64_t{prescaler_} + 1);
  }
  [[nodiscard]] uint64_t top() const { return uint64_t{reload_} + 1; }
  [[nodiscard]] uint32_t width_mask() const { return shape_.wide ? 0xffff'ffff : 0xffff; }
  [[nodiscard]] uint32_t output_mode(uint32_t channel) const {
    const uint32_t half = ccmr_[channel / 2] >> (8 * (channel % 2));
    return (half & 3) != 0 ? uint32_t{frozen} : half >> 4 & 7;  // CCxS: an input never drives the pin
  }
  static constexpr uint32_t from_own_pin = 1, from_trigger = 3;
  /// CCxS: 0 for an output.
  [[nodiscard]] uint32_t input(uint32_t channel) const {
    return ccmr_[channel / 2] >> (8 * (channel % 2)) & 3;
  }
  void capture(uint32_t channel, uint32_t count) {
    if ((sr_ & compare_flag(channel)) != 0) sr_ |= compare_flag(channel) << 8;  // overcapture
    sr_ |= compare_flag(channel);
    channels_[channel].compare = channels_[channel].preload = count & width_mask();
  }
  /// The latest edge of the divided crystal by now, every eighth with IC1PSC = 3 and so on.
  void capture_crystal(Cycles now) {
    if (or_ != 2 || input(0) != from_own_pin || (ccer_ & 1) == 0 || !counting() || !wiring_.crystal_edges)
      return;
    const double spacing = wiring_.crystal_edges() * (1U << (ccmr_[0] >> 2 & 3));
    if (spacing <= 0) return;
    const auto edges = static_cast<uint64_t>(static_cast<double>(now - counting_since_) / spacing);
    if (edges == captured_edges_) return;
    captured_edges_ = edges;
    capture(0, static_cast<uint32_t>(std::llround(static_cast<double>(edges) * spacing) /
                                     static_cast<int64_t>(cycles_per_count())));
  }
  [[nodiscard]] bool preloaded(uint32_t channel) const {
    return (ccmr_[channel / 2] >> (8 * (channel % 2)) & 8) != 0;
  }
  [[nodiscard]] uint64_t counts_to_match(uint32_t channel) const {
    const uint64_t compare = channels_[channel].compare;
    if (compare > count_) return compare - count_;
    return compare < top() ? counts_to_update() + compare : never;
  }
  [[nodiscard]] uint64_t counts_to_update() const {
    return count_ < top() ? top() - count_ : (uint64_t{width_mask()} + 1 - count_) + top();
  }
  [[nodiscard]] bool match_observable(uint32_t channel) const {
    const uint32_t flag = compare_flag(channel);
    const bool interrupts = (dier_ & flag) != 0 && (sr_ & flag) == 0;
    const bool drives = (ccer_ >> (4 * channel) & 1) != 0 && output_mode(channel) != frozen;
    const bool triggers =
        (trigger_mode() == on_compare_pulse && channel == 0) || trigger_mode() == 4 + channel;
    return interrupts || drives || triggers;
  }
  [[nodiscard]] bool update_observable() const {
    if ((cr1_ & update_disable) != 0) return false;
    const bool interrupts = (dier_ & update_flag) != 0 && (sr_ & update_flag) == 0;
    bool drives = false;
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      drives |= output_mode(channel) >= pwm1 && (ccer_ >> (4 * channel) & 1) != 0;
    }
    const bool triggers = trigger_mode() == on_update || trigger_mode() >= 4;
    return interrupts || drives || triggers;
  }
  [[nodiscard]] uint32_t trigger_mode() const { return cr2_ >> 4 & 7; }

  void settle(Cycles to) {
    if (!counting()) {
      count_since_ = to;
      return;
    }
    while (counting()) {
      uint64_t counts = counts_to_update();
      for (uint32_t channel = 0; channel < channel_count; ++channel) {
        counts = std::min(counts, counts_to_match(channel));
      }
      const Cycles at = count_since_ + counts * cycles_per_count();
      if (at > to) {
        const uint64_t passed = (to - count_since_) / cycles_per_count();
        count_ += static_cast<uint32_t>(passed);
        count_since_ += passed * cycles_per_count();
        return;
      }
      advance_count(counts, at);
    }
    count_since_ = to;
  }
  void advance_count(uint64_t counts, Cycles at) {
    const bool overflows = counts >= counts_to_update();
    count_ = overflows ? 0 : count_ + static_cast<uint32_t>(counts);
    count_since_ = at;
    if (overflows) update_event(at, true);
    compare_channels(at);
  }
  void compare_channels(Cycles at) {
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      if (channels_[channel].compare == count_ && input(channel) == 0) match(channel, at);
    }
  }
  void update_event(Cycles at, bool by_overflow) {
    if ((cr1_ & update_disable) != 0) return;
    prescaler_ = prescaler_preload_;
    reload_ = reload_preload_;
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      channels_[channel].compare = channels_[channel].preload;
      const uint32_t mode = output_mode(channel);
      if (mode >= pwm1) set_reference(channel, (channels_[channel].compare > 0) == (mode == pwm1), at);
    }
    if (by_overflow || (cr1_ & update_request_source) == 0) sr_ |= update_flag;
    if (by_overflow && (cr1_ & one_pulse) != 0) cr1_ &= ~1U;
    if (trigger_mode() == on_update && wiring_.trigger_output) wiring_.trigger_output(at);
    set_lines();
  }
  void match(uint32_t channel, Cycles at) {
    sr_ |= compare_flag(channel);
    switch (output_mode(channel)) {
      case active_on_match:
        set_reference(channel, true, at);
        break;
      case inactive_on_match:
        set_reference(channel, false, at);
        break;
      case toggle:
        set_reference(channel, !channels_[channel].reference, at);
        break;
      case pwm1:
        set_reference(channel, false, at);
        break;
      case pwm2:
        set_reference(channel, true, at);
        break;
      default:
        break;
    }
    if (channel == 0 && trigger_mode() == on_compare_pulse && wiring_.trigger_output)
      wiring_.trigger_output(at);
    set_lines();
  }
  void set_reference(uint32_t channel, bool active, Cycles at) {
    Channel& held = channels_[channel];
    const bool rises = active && !held.reference;
    held.reference = active;
    set_outputs(at);
    if (rises && trigger_mode() == 4 + channel && wiring_.trigger_output) wiring_.trigger_output(at);
  }
  void set_outputs(Cycles at) {
    const bool advanced = shape_.number == 1 || shape_.number == 8;
    const bool main_output = !advanced || (bdtr_ >> 15 & 1) != 0;
    for (uint32_t index = 0; index < channel_count; ++index) {
      Channel& channel = channels_[index];
      const uint32_t enable = ccer_ >> (4 * index);
      const bool level = main_output && (enable & 1) != 0 && input(index) == 0 &&
                         channel.reference != ((enable >> 1 & 1) != 0);
      if (level == channel.output) continue;
      channel.output = level;
      if (wiring_.output) wiring_.output(static_cast<uint8_t>(index + 1), level, at);
    }
  }
  void set_directions(Cycles at) {
    for (uint32_t index = 0; index < channel_count; ++index) {
      const bool is_input = input(index) != 0;
      if (std::exchange(channels_[index].is_input, is_input) != is_input && wiring_.direction)
        wiring_.direction(static_cast<uint8_t>(index + 1), is_input, at);
    }
  }
  void apply_forced_modes(Cycles at) {
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      const uint32_t mode = output_mode(channel);
      if (mode == force_inactive || mode == force_active) set_reference(channel, mode == force_active, at);
      if (mode >= pwm1) set_reference(channel, (count_ < channels_[channel].compare) == (mode == pwm1), at);
    }
  }
  void write_compare(uint32_t channel, uint32_t value) {
    Channel& held = channels_[channel];
    held.preload = value;
    if (preloaded(channel)) return;
    held.compare = value;
    const uint32_t mode = output_mode(channel);
    if (mode >= pwm1) return apply_forced_modes(clock_.now());
    const bool moves_pin = (mode == active_on_match || mode == inactive_on_match || mode == toggle) &&
                           (ccer_ >> (4 * channel) & 1) != 0;
    const bool triggers = channel == 0 && trigger_mode() == on_compare_pulse;
    const uint32_t late = (count_ - value) & width_mask();
    if ((moves_pin || triggers) && counting() && wiring_.missed && late <= width_mask() / 2) {
      wiring_.missed(static_cast<uint8_t>(channel + 1), late * cycles_per_count());
    }
  }
  void write_slave_mode(uint32_t value) {
    const bool other_trigger = ((value ^ smcr_) & 0x70) != 0;
    if (other_trigger && ((value | smcr_) & 7) != 0)
      notes_.add("TIM" + std::to_string(shape_.number) + ": SMCR.TS changed with the slave mode on");
    smcr_ = value;
  }
  void write_control(uint32_t value) {
    if ((value & 0x70) != 0) unmodelled("counting down or centre-aligned");
    const bool starts = (value & 1) != 0 && (cr1_ & 1) == 0;
    cr1_ = value;
    if (starts) {
      count_since_ = counting_since_ = clock_.now();
      captured_edges_ = 0;
    }
    if (starts && trigger_mode() == on_enable && wiring_.trigger_output) wiring_.trigger_output(clock_.now());
  }
  void generate(uint32_t bits, Cycles at) {
    if (bits & update_flag) {
      count_ = 0;
      count_since_ = at;
      update_event(at, false);
      if (trigger_mode() == on_reset && wiring_.trigger_output) wiring_.trigger_output(at);
    }
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      if (bits & compare_flag(channel)) sr_ |= compare_flag(channel);
    }
  }
  void set_lines() {
    const uint32_t asked = sr_ & dier_ & 0xff;
    const uint32_t source = shape_.line_source;
    if (shape_.update_irq == shape_.compare_irq) return nvic_.set_line(shape_.update_irq, asked != 0, source);
    nvic_.set_line(shape_.update_irq, (asked & update_flag) != 0, source);
    nvic_.set_line(shape_.compare_irq, (asked & 0x1e) != 0, source);
  }
  void ask() {
    if (!counting()) return scheduler_.set(slot_, never);
    uint64_t counts = update_observable() || (cr1_ & one_pulse) != 0 ? counts_to_update() : never;
    for (uint32_t channel = 0; channel < channel_count; ++channel) {
      if (match_observable(channel)) counts = std::min(counts, counts_to_match(channel));
    }
    scheduler_.set(slot_, counts == never ? never : count_since_ + counts * cycles_per_count());
  }
  void unmodelled(const char* what) {
    notes_.add("TIM" + std::to_string(shape_.number) + ": " + what + " is not modelled");
  }

  Shape shape_;
  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Notes& notes_;
  Scheduler::Slot slot_;
  Wiring wiring_;

  uint32_t cr1_ = 0, cr2_ = 0, smcr_ = 0, dier_ = 0, sr_ = 0, ccer_ = 0, bdtr_ = 0, rcr_ = 0, dcr_ = 0,
           dmar_ = 0, or_ = 0;
  uint64_t captured_edges_ = 0;
  Cycles counting_since_ = 0;
  std::array<uint32_t, 2> ccmr_{};
  uint32_t prescaler_ = 0, prescaler_preload_ = 0;
  uint32_t reload_ = 0, reload_preload_ = 0;
  std::array<Channel, channel_count> channels_{};
  uint32_t count_ = 0;
  Cycles count_since_ = 0;  ///< when the counter took the value `count_`
};

}  // namespace diastole::board_model
