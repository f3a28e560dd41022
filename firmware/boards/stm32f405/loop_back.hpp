#pragma once
// What the board measures of its own outputs over three wires that a person puts on for it (docs/on-the-chip.md):
//
//   STEP    PA6 to PA3   TIM5_CH4 (AF2) captures its rise; TIM9_CH2 (AF3) counts rises by their edges alone
//   TTL     PA1 to PA5   TIM2_CH1 (AF1) captures its rise
//   R-wave  PA4 to PC3   ADC123_IN13, from behind the follower if there is one
//
// TIM2 and TIM5 share the count by which edges are scheduled, so a capture says by how much a tick was missed, to one tick
// (12 ns). The pulls are down: a wire that is not there shows no edge. Nothing of it is left switched on between two
// measurements.

#include <cstdint>
#include <optional>

#include "firmware/boards/stm32f405/pulse_timer.hpp"
#include "firmware/boards/stm32f405/r_wave_player.hpp"
#include "protocol/wire/self_test_messages.hpp"

namespace diastole::stm32 {

class LoopBack {
 public:
  /// Both outlive this.
  LoopBack(PulseTimer& timer, RWavePlayer& r_wave) : timer_(timer), r_wave_(r_wave) {}

  /// Takes 42 ms at most and feeds the watchdog. Precondition: nothing is scheduled, and no wave is being played.
  wire::SelfTestReport measure(wire::SelfTestItem item, std::uint16_t argument, bool ttl_active_low);

 private:
  void pulse(wire::SelfTestReport& report, bool ttl_active_low);
  void order_pulse(std::uint32_t tick);
  void steps(wire::SelfTestReport& report);
  void level(wire::SelfTestReport& report);

  PulseTimer& timer_;
  RWavePlayer& r_wave_;
};

}  // namespace diastole::stm32
