#pragma once
// What is wired where on the Olimex STM32-H405. docs/wiring.md draws it and repeats this table; a test compares them.
//
//   pin   signal     function           direction
//   PA1   TTL        TIM2_CH2 (AF1)     out     also starts the R-wave through TIM4
//   PA2   DIR        TIM2_CH3 (AF1)     out     high = inflate
//   PA4   R-wave     DAC_OUT1           out     15 kOhm: through a follower and a divider of 1 : 125 to the
//                                               scanner's ECG input
//   PA6   STEP       TIM3_CH1 (AF2)     out
//   PB0   ENABLE     GPIO               out     high = motor powered
//   PB1   FAULT      GPIO               out     high = a fault is latched
//   PB10  TX         USART3_TX (AF7)    out
//   PB11  RX         USART3_RX (AF7)    in      pull-up: idles high without a cable
//   PC0   e-stop     EXTI0              in      pull-up: open loop (high) = pressed
//   PC1   home       EXTI1              in      pull-up: open contact (high) = closed on the piston
//   PC2   far limit  EXTI2              in      pull-up: as home
//
// PA3, PA5 and PC3 are left as after reset, but for a self-test's measurements (loop_back.hpp).
//
// Switches are normally closed to ground, so that a broken wire reads as pressed.

#include <cstdint>

namespace diastole::stm32 {

inline constexpr std::uint32_t kTtlPin = 1U << 1;
inline constexpr std::uint32_t kDirPin = 1U << 2;
inline constexpr std::uint32_t kEnablePin = 1U << 0;
inline constexpr std::uint32_t kFaultPin = 1U << 1;
inline constexpr std::uint32_t kEstopPin = 1U << 0;
inline constexpr std::uint32_t kHomePin = 1U << 1;
inline constexpr std::uint32_t kFarLimitPin = 1U << 2;

/// Configures all of them, outputs low, and the input interrupts on both edges.
void configure_pins();

}  // namespace diastole::stm32
