#include "firmware/boards/stm32f405/clocks.hpp"

#include <optional>

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

namespace {

/// Turns of a waiting loop at 16 MHz: some 0.1 s, fifty times what a crystal takes to start.
constexpr unsigned kMostTurns = 200'000;

bool wait_for(const Register& reg, std::uint32_t bits) {
  for (unsigned turn = 0; turn < kMostTurns; ++turn)
    if ((reg.read() & bits) == bits) return true;
  return false;
}

/// The counter when the next eighth edge of the divided crystal comes.
std::optional<std::uint32_t> next_capture() {
  constexpr std::uint32_t kCaptured = 1U << 1;
  if (!wait_for(tim11().SR, kCaptured)) return {};
  return tim11().CCR1.read();
}

/// RM0090 7.2.11 and 19.4.13: TIM11 counts the internal oscillator's 16 MHz between edges of the crystal's, divided by 16
/// (RTCPRE) and by 8 (IC1PSC). The internal oscillator is within -8 and +4.5 % from -40 to 105 °C (datasheet table 42);
/// the crystals that boards have, 8, 12, 16 and 25 MHz, are 50 % apart.
bool crystal_is_ours() {
  constexpr std::uint32_t kDividedBy16 = 16U << 16, kTim11Clock = 1U << 18, kFromCrystal = 2U,
                          kCaptureEighth = 1U | 3U << 2, kEnable = 1U, kCount = 1U;
  constexpr std::uint32_t kExpected = 16 * 16 * 8 / kCrystal_MHz, kTolerance = kExpected * 15 / 100;
  rcc().CFGR.write(kDividedBy16);
  enable_clocks(rcc().APB2ENR, kTim11Clock);
  tim11().ARR.write(0xFFFF);
  tim11().OR.write(kFromCrystal);
  tim11().CCMR1.write(kCaptureEighth);
  tim11().CCER.write(kEnable);
  tim11().CR1.write(kCount);
  (void)next_capture();
  const auto first = next_capture();
  const auto second = next_capture();
  tim11().CR1.write(0);
  rcc().APB2ENR.clear(kTim11Clock);
  rcc().CFGR.write(0);
  if (!first || !second) return false;
  const std::uint32_t counted = (*second - *first) & 0xFFFFU;
  return counted >= kExpected - kTolerance && counted <= kExpected + kTolerance;
}

/// Revision A calls itself a 0x411 and must not prefetch (errata sheet ES0182, 2.2.1 and 2.2.2).
bool may_prefetch() {
  constexpr std::uint32_t kDeviceId = 0xFFF;
  return (debug().IDCODE.read() & kDeviceId) != 0x411;
}

}  // namespace

ClockSource start_clocks() {
  constexpr std::uint32_t kHseOn = 1U << 16, kHseReady = 1U << 17, kCrystalWatch = 1U << 19,
                          kPllOn = 1U << 24, kPllReady = 1U << 25;
  rcc().CR.set(kHseOn);
  const bool from_crystal = wait_for(rcc().CR, kHseReady) && crystal_is_ours();
  if (from_crystal)
    rcc().CR.set(kCrystalWatch);
  else
    rcc().CR.clear(kHseOn);
  // 5 wait states at 168 MHz and 3.3 V; instruction and data cache, prefetch (RM0090 3.5.1).
  flash().ACR.write(5U | (may_prefetch() ? 1U << 8 : 0U) | 1U << 9 | 1U << 10);
  // VCO = 1 MHz · 336, core = VCO / 2, 48 MHz = VCO / 7.
  constexpr std::uint32_t kInternal_MHz = 16;
  const std::uint32_t source = from_crystal ? kCrystal_MHz | 1U << 22 : kInternal_MHz;
  constexpr std::uint32_t kReserved = 2U << 28;  // as after reset
  rcc().PLLCFGR.write(source | 336U << 6 | 0U << 16 | 7U << 24 | kReserved);
  rcc().CR.set(kPllOn);
  while ((rcc().CR.read() & kPllReady) == 0) {
  }
  // AHB undivided, APB1 / 4, APB2 / 2, system clock from the PLL.
  rcc().CFGR.write(5U << 10 | 4U << 13 | 2U);
  while ((rcc().CFGR.read() & 0xCU) != 0x8U) {
  }
  enable_clocks(rcc().AHB1ENR, 1U << 0 | 1U << 1 | 1U << 2 | 1U << 21);  // GPIOA, GPIOB, GPIOC, DMA1
  enable_clocks(rcc().AHB2ENR, 1U << 6);                                 // RNG
  enable_clocks(rcc().APB1ENR, 0xFU | 1U << 18 | 1U << 28 | 1U << 29);   // TIM2 … TIM5, USART3, PWR, DAC
  enable_clocks(rcc().APB2ENR, 1U << 14);                                // SYSCFG
  return from_crystal ? ClockSource::crystal : ClockSource::internal;
}

void start_systick() {
  systick().LOAD.write(kCore_Hz / 1000 - 1);
  systick().VAL.write(0);
  systick().CTRL.write(7);
}

}  // namespace diastole::stm32
