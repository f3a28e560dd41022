#pragma once
// 168 MHz from the crystal; APB1 timers at 84 MHz, USART3 at 42 MHz.

namespace diastole::stm32 {

/// The crystal of the Olimex STM32-H405. The PLL's input is 1 MHz, so another crystal changes this number
/// only.
inline constexpr unsigned kCrystal_MHz = 8;
inline constexpr unsigned kCore_Hz = 168'000'000;
inline constexpr unsigned kApb1_Hz = 42'000'000;

/// Switches to the crystal and the PLL and enables the clocks of every peripheral used. A crystal that does
/// not start leaves the controller waiting here with all outputs off.
void start_clocks();

/// A turn of the main loop is due every millisecond: SysTick_Handler.
void start_systick();

}  // namespace diastole::stm32
