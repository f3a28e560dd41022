#include "firmware/boards/stm32f405/loop_back.hpp"

#include <initializer_list>

#include "firmware/boards/stm32f405/converter.hpp"
#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/boards/stm32f405/watchdog.hpp"
#include "firmware/core/units.hpp"

namespace diastole::stm32 {

namespace {

using firmware::lower_half;
using firmware::microseconds;

constexpr std::uint32_t kTim9Clock = 1U << 16;
constexpr std::uint32_t kCapture1 = 1U << 1, kCapture4 = 1U << 4,
                        kCapturedAgain = 8;  // shift from CCxIF to CCxOF
constexpr unsigned kRWaveInput = 13;

std::uint32_t clock_now() { return tim2().CNT.read(); }
bool has_come(std::uint32_t tick) { return static_cast<std::int32_t>(clock_now() - tick) >= 0; }
std::uint32_t in_microseconds(std::int64_t count) { return clock_now() + lower_half(microseconds(count)); }

void wait_until(std::uint32_t tick) {
  while (!has_come(tick)) {
  }
}

constexpr unsigned kStepPin = 3, kTtlPin = 5, kRWavePin = 3;

/// A pin's two bits of MODER or PUPDR, its four of AFR.
void set_two(Register& bits, unsigned pin, std::uint32_t value) {
  bits.change(3U << 2 * pin, value << 2 * pin);
}
void set_function(unsigned pin, std::uint32_t function) {
  gpio_a().AFR[0].change(0xFU << 4 * pin, function << 4 * pin);
}

/// PA3, PA5 and PC3 are inputs of timers and of the converter while one of these lives, then again as after reset.
class LoopPins {
 public:
  /// Alternate functions of PA3 (datasheet table 9).
  enum class Step : std::uint8_t { to_tim5 = 2, to_tim9 = 3 };

  explicit LoopPins(Step step) {
    constexpr std::uint32_t kDown = 2, kAlternate = 2, kAnalog = 3;
    set_function(kStepPin, static_cast<std::uint32_t>(step));
    set_function(kTtlPin, 1);
    for (const unsigned pin : {kStepPin, kTtlPin}) {
      set_two(gpio_a().PUPDR, pin, kDown);
      set_two(gpio_a().MODER, pin, kAlternate);
    }
    set_two(gpio_c().MODER, kRWavePin, kAnalog);
  }
  ~LoopPins() {
    for (const unsigned pin : {kStepPin, kTtlPin}) {
      set_two(gpio_a().MODER, pin, 0);
      set_two(gpio_a().PUPDR, pin, 0);
      set_function(pin, 0);
    }
    set_two(gpio_c().MODER, kRWavePin, 0);
  }
  LoopPins(const LoopPins&) = delete;
  LoopPins& operator=(const LoopPins&) = delete;
};

/// TIM5's channel 4 and TIM2's channel 1 capture the pins' edges to the active level while one of these lives.
class Captures {
 public:
  explicit Captures(bool ttl_active_low) {
    tim5().CCMR2.write(kOwnPin << 8);
    tim5().CCER.set(1U << 12);
    tim2().CCMR1.change(3U, kOwnPin);
    tim2().CCER.change(3U, ttl_active_low ? 3U : 1U);
    tim5().SR.write(kTimerFlags & ~(kCapture4 | kCapture4 << kCapturedAgain));
    tim2().SR.write(kTimerFlags & ~(kCapture1 | kCapture1 << kCapturedAgain));
  }
  ~Captures() {
    tim5().CCER.clear(1U << 12);
    tim5().CCMR2.write(0);
    tim2().CCER.clear(3U);
    tim2().CCMR1.write(ttl_mode_);
  }
  Captures(const Captures&) = delete;
  Captures& operator=(const Captures&) = delete;

  static std::int32_t step_late(std::uint32_t tick) {
    return (tim5().SR.read() & kCapture4) == 0 ? wire::kNotSeen
                                               : static_cast<std::int32_t>(tim5().CCR4.read() - tick);
  }
  static std::uint16_t ttl_rises() {
    const std::uint32_t flags = tim2().SR.read();
    return (flags & kCapture1) == 0 ? 0 : (flags & kCapture1 << kCapturedAgain) == 0 ? 1 : 2;
  }
  static std::int32_t ttl_late(std::uint32_t tick) {
    return static_cast<std::int32_t>(tim2().CCR1.read() - tick);
  }

 private:
  static constexpr std::uint32_t kOwnPin = 1;     // CCxS: TIx
  std::uint32_t ttl_mode_ = tim2().CCMR1.read();  // of channel 2, which is at rest before and after
};

/// From `tick` on, for as long as the R-wave keeps its first code: the end of the first conversion above `threshold`.
std::int32_t late_above(std::uint32_t threshold, std::uint32_t tick) {
  const std::uint32_t end = tick + lower_half(microseconds(60));
  while (!has_come(end)) {
    const std::uint32_t code = convert(kRWaveInput, SamplingTime::cycles_28);
    if (code > threshold) return static_cast<std::int32_t>(clock_now() - tick);
  }
  return wire::kNotSeen;
}

/// Mean of 16, rounded; 0.4 ms.
std::uint16_t mean_code(unsigned channel) {
  constexpr std::uint32_t kReadings = 16;
  std::uint32_t sum = 0;
  for (std::uint32_t i = 0; i < kReadings; ++i)
    sum += convert(channel, SamplingTime::cycles_480);
  return static_cast<std::uint16_t>((sum + kReadings / 2) / kReadings);
}

}  // namespace

wire::SelfTestReport LoopBack::measure(wire::SelfTestItem item, std::uint16_t argument, bool ttl_active_low) {
  wire::SelfTestReport report;
  report.item = item;
  report.argument = argument;
  const InterruptHeld step_interrupt_held(kTim5);
  switch (item) {
    case wire::SelfTestItem::pulse:
      pulse(report, ttl_active_low);
      break;
    case wire::SelfTestItem::steps:
      steps(report);
      break;
    case wire::SelfTestItem::level:
      level(report);
      break;
    case wire::SelfTestItem::supply: {
      const Converter on(Converter::Reference::on);
      report.code = mean_code(kReferenceInput);
      break;
    }
  }
  timer_.rest();
  return report;
}

/// The R-wave begins with half of full scale instead of its first code, which would be lost in the converter's noise.
void LoopBack::pulse(wire::SelfTestReport& report, bool ttl_active_low) {
  constexpr std::uint16_t kFirstCode = 2048;
  const Converter on;
  const LoopPins pins(LoopPins::Step::to_tim5);
  const Captures captures(ttl_active_low);
  r_wave_.hold(0);
  r_wave_.arm_with(kFirstCode);
  const std::uint32_t tick = in_microseconds(50);
  timer_.step(tick);
  timer_.raise_ttl(tick, microseconds(20));
  wait_until(tick);
  report.r_wave_late_ticks = late_above(kFirstCode / 2, tick);
  wait_until(tick + lower_half(microseconds(70)));  // both pulses have ended
  report.step_late_ticks = captures.step_late(tick);
  report.counted = captures.ttl_rises();
  report.ttl_late_ticks = report.counted == 0 ? wire::kNotSeen : captures.ttl_late(tick);
  r_wave_.disarm();
  r_wave_.hold(0);
}

/// TIM9 counts by the edges of its second input alone (RM0090 19.3.3, external clock mode 1).
void LoopBack::steps(wire::SelfTestReport& report) {
  constexpr std::uint32_t kFromSecondInput = 6U << 4, kClockedByIt = 7U, kSecondInput = 1U << 8;
  enable_clocks(rcc().APB2ENR, kTim9Clock);
  const LoopPins pins(LoopPins::Step::to_tim9);
  tim9().CCMR1.write(kSecondInput);
  tim9().ARR.write(0xFFFF);
  tim9().SMCR.write(kFromSecondInput);  // TS first, then SMS (18.4.3)
  tim9().SMCR.write(kFromSecondInput | kClockedByIt);
  tim9().CR1.write(1);
  std::uint32_t tick = in_microseconds(50);
  for (std::uint16_t i = 0; i < report.argument; ++i) {
    timer_.step(tick);
    while (!timer_.step_done()) {
    }
    tick += lower_half(microseconds(10));
    feed_watchdog();
  }
  wait_until(tick);
  report.counted = static_cast<std::uint16_t>(tim9().CNT.read());
  rcc().APB2RSTR.set(kTim9Clock);
  rcc().APB2RSTR.clear(kTim9Clock);
  rcc().APB2ENR.clear(kTim9Clock);
}

void LoopBack::level(wire::SelfTestReport& report) {
  const Converter on;
  const LoopPins pins(LoopPins::Step::to_tim5);
  r_wave_.hold(report.argument);
  wait_until(in_microseconds(100));
  report.code = mean_code(kRWaveInput);
  r_wave_.hold(0);
}

}  // namespace diastole::stm32
