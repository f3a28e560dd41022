#pragma once
// 168 MHz from the crystal; APB1 timers at 84 MHz, USART3 at 42 MHz. A crystal that does not start, or is not the one
// that this image was built for, is replaced by the chip's own oscillator: 168 MHz to 1 % at room temperature, enough to
// speak with the host and to report this, not to move by.

namespace diastole::stm32 {

/// The crystal of the Olimex STM32-H405. The PLL's input is 1 MHz, so another crystal changes this number
/// only.
inline constexpr unsigned kCrystal_MHz = 8;
inline constexpr unsigned kCore_Hz = 168'000'000;
inline constexpr unsigned kApb1_Hz = 42'000'000;

enum class ClockSource { crystal, internal };

/// Switches to the PLL and enables the clocks of every peripheral used, at most 0.2 s later. From the crystal, if it runs at
/// kCrystal_MHz to 15 % against the chip's own oscillator, and then its failure is an NMI that finds the core on that
/// oscillator.
ClockSource start_clocks();

/// A turn of the main loop is due every millisecond: SysTick_Handler.
void start_systick();

}  // namespace diastole::stm32
