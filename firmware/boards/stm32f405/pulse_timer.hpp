#pragma once
// The clock and the edges. TIM2 is the clock: its 32-bit counter at 84 MHz wraps every 51 s; the overflow
// interrupt makes 64 bits. Its channel 2 makes the TTL, channel 3 DIR, and TIM5 with TIM3 make STEP
// (step_timer.hpp): the compare unit moves the pin when the counter gets there, so interrupt latency never shows
// on an edge.
//
//   STEP  ___|‾‾|_________|‾‾|___      step_timer.hpp
//   TTL   ___|‾‾‾‾‾‾‾‾‾‾‾‾‾|_____      rise: CCR2 = tick, "active on match"; its interrupt sets CCR2 = tick + width,
//                                      "inactive on match". The rise is TIM2's TRGO and starts the R-wave
//   DIR   ‾‾‾‾‾‾‾‾|______________      CCR3 = tick of the next step - 5 µs, only when it changes

#include <atomic>
#include <cstdint>
#include <optional>

#include "firmware/boards/stm32f405/step_timer.hpp"
#include "firmware/core/board.hpp"

namespace diastole::stm32 {

class PulseTimer {
 public:
  void start();
  /// Polarity of the TTL. Precondition: it is at rest.
  void use(bool ttl_active_low);
  [[nodiscard]] firmware::Ticks now() const;
  [[nodiscard]] std::int32_t ticks_until(std::uint32_t tick) const {
    return firmware::ticks_between(tim2().CNT.read(), tick);
  }
  /// TIM5's interrupt reports when the order has been carried out.
  void schedule(const firmware::PulseOrder& order) {
    steps_.schedule(order.tick, order.step);
    if (order.ttl) raise_ttl(order.tick, order.ttl_width);
    if (order.step && order.inflate != inflate_) set_direction(order.inflate, order.tick);
  }
  /// A STEP in the direction that DIR has. TIM5's interrupt may be held off: step_done() says the same.
  void step(std::uint32_t tick) { steps_.schedule(tick, true); }
  [[nodiscard]] static bool step_done() { return StepTimer::matched(); }
  /// A tick that has passed raises it at once. Precondition: the TTL before has fallen.
  void raise_ttl(std::uint32_t tick, firmware::Ticks width);
  /// When the TTL ordered for `tick` rose: as captured, and if the pin was seen active. One that rose as ordered is captured
  /// within kSynchroniser and has risen at `tick`.
  [[nodiscard]] std::optional<std::uint32_t> ttl_rise(std::uint32_t tick) const;
  void rest() { steps_.rest(); }
  void cancel();
  /// TIM2's interrupt: the counter has wrapped, or the TTL is to fall.
  void interrupt();

 private:
  void set_direction(bool inflate, std::uint32_t step_tick);
  void ttl_interrupt();

  /// Ticks from a timer's trigger output to a capture by another, with room: 2 or 3 (RM0090 18.3.15).
  static constexpr std::int32_t kSynchroniser = 6;
  StepTimer steps_;
  std::atomic<std::uint32_t> wraps_{0};
  bool ttl_rising_ = false;
  bool ttl_seen_active_ = false;  ///< of the pin, in the interrupt of its rise
  bool inflate_ = false;
  bool ttl_active_low_ = false;
  [[nodiscard]] bool ttl_is_active() const;
  std::uint32_t ttl_width_ = 0;
};

}  // namespace diastole::stm32
