#include "firmware/boards/stm32f405/pulse_timer.hpp"

#include "firmware/boards/stm32f405/pins.hpp"
#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

using firmware::Ticks;

namespace {

constexpr std::uint32_t kUpdate = 1U << 0, kCompare2 = 1U << 2;

/// Output compare modes, RM0090 18.4.7.
enum Mode : std::uint32_t { kFrozen = 0, kActiveOnMatch = 1, kInactiveOnMatch = 2, kLow = 4, kHigh = 5 };

void set_ttl_mode(Mode mode) { tim2().CCMR1.change(7U << 12, mode << 12); }
void set_direction_mode(Mode mode) { tim2().CCMR2.change(7U << 4, mode << 4); }

/// Flags are cleared by writing 0; writing 1 leaves them.
void clear_flag(std::uint32_t flag) { tim2().SR.write(kTimerFlags & ~flag); }

bool has_passed(std::uint32_t tick) { return static_cast<std::int32_t>(tim2().CNT.read() - tick) >= 0; }

}  // namespace

void PulseTimer::start() {
  tim2().PSC.write(0);
  tim2().ARR.write(0xFFFF'FFFFU);
  set_ttl_mode(kLow);
  set_direction_mode(kLow);
  use(ttl_active_low_);
  tim2().EGR.write(1);
  clear_flag(kUpdate);
  tim2().DIER.write(kUpdate);
  steps_.start();
  tim2().CR2.write(1U << 4);  // TRGO = the counter's start, which TIM5 follows
  tim2().CR1.write(1);
  steps_.let_go();
  tim2().CR2.write(5U << 4);  // TRGO = OC2REF, which the R-wave follows
  enable_interrupt(kTim2, 1);
}

void PulseTimer::use(bool ttl_active_low) {
  ttl_active_low_ = ttl_active_low;
  tim2().CCER.write(1U << 4 | 1U << 8 | (ttl_active_low ? 1U << 5 : 0U));
}

bool PulseTimer::ttl_is_active() const { return ((gpio_a().IDR.read() & kTtlPin) != 0) != ttl_active_low_; }

Ticks PulseTimer::now() const {
  while (true) {
    const std::uint32_t wraps = wraps_.load(std::memory_order_relaxed);
    const std::uint32_t count = tim2().CNT.read();
    const bool unserved = (tim2().SR.read() & kUpdate) != 0 && count < 0x8000'0000U;
    if (wraps == wraps_.load(std::memory_order_relaxed))
      return {static_cast<std::int64_t>(std::uint64_t{wraps + (unserved ? 1U : 0U)} << 32 | count)};
  }
}

void PulseTimer::set_direction(bool inflate, std::uint32_t step_tick) {
  const std::uint32_t due = step_tick - static_cast<std::uint32_t>(firmware::kDirectionSetup.count);
  inflate_ = inflate;
  tim2().CCR3.write(due);
  set_direction_mode(inflate ? kActiveOnMatch : kInactiveOnMatch);
  if (has_passed(due)) set_direction_mode(inflate ? kHigh : kLow);
}

void PulseTimer::raise_ttl(std::uint32_t tick, Ticks width) {
  ttl_width_ = firmware::lower_half(width);
  ttl_rising_ = true;
  ttl_seen_active_ = false;
  tim2().CCR2.write(tick);
  // The mode before the flag: a match that comes before the mode is forgotten, and made good below; one that comes between them is
  // forgotten too, but has raised the pin, which stays as it is.
  set_ttl_mode(kActiveOnMatch);
  clear_flag(kCompare2);
  if (has_passed(tick) && (tim2().SR.read() & kCompare2) == 0) {
    // The match has been missed: a late trigger, reported as such, is better than none that is counted.
    set_ttl_mode(kHigh);
    tim2().CCR2.write(tim2().CNT.read());
    tim2().EGR.write(kCompare2);
  }
  tim2().DIER.set(kCompare2);
}

std::optional<std::uint32_t> PulseTimer::ttl_rise(std::uint32_t tick) const {
  const bool active = ttl_rising_ ? ttl_is_active() : ttl_seen_active_;
  const std::uint32_t captured = steps_.captured_trigger();
  const std::int32_t late = firmware::ticks_between(tick, captured);
  if (!active || late < 0) return {};
  return late <= kSynchroniser ? tick : captured;
}

void PulseTimer::cancel() {
  steps_.rest();
  tim2().DIER.clear(kCompare2);
  set_ttl_mode(kLow);
  set_direction_mode(kFrozen);
  inflate_ = (gpio_a().IDR.read() & kDirPin) != 0;
  clear_flag(kCompare2);
}

void PulseTimer::ttl_interrupt() {
  if (!ttl_rising_) {
    tim2().DIER.clear(kCompare2);
    return;
  }
  ttl_rising_ = false;
  ttl_seen_active_ = ttl_is_active();
  const std::uint32_t fall = tim2().CCR2.read() + ttl_width_;
  tim2().CCR2.write(fall);
  set_ttl_mode(kInactiveOnMatch);
  if (has_passed(fall)) set_ttl_mode(kLow);
}

void PulseTimer::interrupt() {
  const std::uint32_t flags = tim2().SR.read() & tim2().DIER.read();
  clear_flag(flags);
  if ((flags & kUpdate) != 0) wraps_.fetch_add(1, std::memory_order_relaxed);
  if ((flags & kCompare2) != 0) ttl_interrupt();
}

}  // namespace diastole::stm32
