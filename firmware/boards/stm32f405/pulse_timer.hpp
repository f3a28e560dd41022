#pragma once
// TIM2: the clock and the edges. The 32-bit counter at 84 MHz wraps every 51 s; its overflow interrupt makes
// 64 bits. Channel 1 makes STEP, 2 the TTL, 3 DIR: the compare unit moves the pin when the counter gets
// there, so interrupt latency never shows on an edge.
//
//   STEP  ___|‾‾|_________|‾‾|___      rise: CCR1 = tick, "active on match"
//            ^  ^                      its interrupt sets CCR1 = tick + 2 µs, "inactive on match";
//            |  order carried out      that one's interrupt asks for the next order
//   TTL   ___|‾‾‾‾‾‾‾‾‾‾‾‾‾|_____      same with CCR2; its rise is TIM2's TRGO and starts the R-wave
//   DIR   ‾‾‾‾‾‾‾‾|______________      CCR3 = tick of the next step - 5 µs, only when it changes

#include <atomic>
#include <cstdint>

#include "firmware/core/board.hpp"

namespace diastole::stm32 {

class PulseTimer {
 public:
  void start();
  [[nodiscard]] firmware::Ticks now() const;
  void schedule(const firmware::PulseOrder& order);
  void cancel();
  /// TIM2's interrupt; true if the order has been carried out.
  bool interrupt();

 private:
  enum class Phase : std::uint8_t { idle, rising, falling, marker };

  void set_direction(bool inflate, std::uint32_t step_tick);
  bool step_interrupt();
  void ttl_interrupt();

  std::atomic<std::uint32_t> wraps_{0};
  Phase phase_ = Phase::idle;
  bool ttl_rising_ = false;
  bool inflate_ = false;
  std::uint32_t ttl_width_ = 0;
};

}  // namespace diastole::stm32
