#pragma once
// STEP: one interrupt a step, no software in the pulse. TIM5 counts in step with TIM2, the clock. Its compare
// event triggers TIM3 (internal trigger ITR2), which makes one pulse and stops: RM0090 18.3.10 (one-pulse mode),
// 18.3.15 (timer synchronization), table 97.
//
//   TIM5  ------ CCR1 ----------------------- CCR1 --     its interrupt asks for the next order at once:
//                  |'-> interrupt               |         the pulse needs nobody
//   TIM3         ..0 1 ... 168 0              ..0 1 ...   starts at the trigger, stops at its reload
//   STEP  _________|‾‾‾‾‾‾‾‾‾‾|_________________|‾‾‾‾     PWM mode 2: high from count 1 on
//
// TIM3 is high one tick after the compare event, hence CCR1 = tick - 1. The chip's synchronisers may add one or two
// ticks, always the same, to every edge of STEP.

#include <cstdint>

#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/core/board.hpp"

namespace diastole::stm32 {

class StepTimer {
 public:
  /// TIM5 begins to count when TIM2 does: call before TIM2 is started.
  void start();
  /// TIM2 has been started: once TIM5 counts it needs TIM2 no more.
  void let_go() {
    while ((tim5().CR1.read() & kCounting) == 0) {
    }
    tim5().SMCR.write(kFromTim2);
    tim5().CCMR1.write(kCaptureTrigger);
    tim5().CCER.write(1U << 4);
  }
  /// When the last TTL rose, on the count that both timers share. TIM5's channel 2 captures its internal trigger, TIM2's TRGO,
  /// which is the reference that the pin follows (18.3.5; TRC). The synchroniser makes it some ticks late.
  [[nodiscard]] std::uint32_t captured_trigger() const { return tim5().CCR2.read(); }

  /// Compare event at `tick`, with a pulse on STEP or without.
  void schedule(std::uint32_t tick, bool step) {
    tim5().SR.write(kTimerFlags & ~kCompare);
    tim5().CCR1.write(tick - kPulseDelay);
    tim3().SMCR.write(step ? kStartedByTim5 : kFromTim5);
    tim5().DIER.write(kCompare);
  }
  /// Whether the compare event that was scheduled has come.
  [[nodiscard]] static bool matched() { return (tim5().SR.read() & kCompare) != 0; }
  /// No compare event has a consequence; a pulse that has begun ends in time.
  void rest() {
    tim3().SMCR.write(kFromTim5);
    tim5().DIER.write(0);
    tim5().SR.write(kTimerFlags & ~kCompare);
  }

 private:
  static constexpr std::uint32_t kPulseDelay = 1;
  static constexpr std::uint32_t kCompare = 1U << 1, kCounting = 1U << 0;
  static constexpr std::uint32_t kFromTim2 = 0U << 4;        ///< TS = ITR0, slave mode off
  static constexpr std::uint32_t kCaptureTrigger = 3U << 8;  ///< CC2S = TRC
  /// TS = ITR2, and so for ever: it may not change while SMS is on, or an edge is seen that is none (18.4.3).
  static constexpr std::uint32_t kFromTim5 = 2U << 4;
  static constexpr std::uint32_t kStartedByTim5 = kFromTim5 | 6U;  ///< SMS: trigger mode
};

}  // namespace diastole::stm32
