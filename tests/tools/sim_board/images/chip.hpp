#pragma once
// The few registers of the STM32F405 that the test images use, by address, and what they tell the test.

#include <stdint.h>

inline volatile uint32_t& at(uint32_t address) { return *reinterpret_cast<volatile uint32_t*>(address); }

/// Words that the test reads at 0x2000'0000.
extern volatile uint32_t seen[64];

// Register blocks; board.ld gives them their addresses.
extern struct Rcc {
  volatile uint32_t cr, pllcfgr, cfgr, cir, rest1[8], ahb1enr, ahb2enr, rest2[2], apb1enr, apb2enr, rest3[11],
      csr;
} rcc;
extern struct FlashInterface { volatile uint32_t acr, keyr, optkeyr, sr, cr; } flash;
extern struct Port {
  volatile uint32_t moder, otyper, ospeedr, pupdr, idr, odr, bsrr, lckr, afr[2];
} gpioa, gpiob;
extern struct Tim {
  volatile uint32_t cr1, cr2, smcr, dier, sr, egr, ccmr1, ccmr2, ccer, cnt, psc, arr, rcr, ccr[4];
} tim2, tim3, tim6;
extern struct Usart { volatile uint32_t sr, dr, brr, cr1; } usart1;
extern struct Dac { volatile uint32_t cr, swtrigr, dhr12r1; } dac;
extern struct Iwdg { volatile uint32_t kr, pr, rlr; } iwdg;

/// And reads them back: they need some cycles to come up.
inline void enable_clocks(volatile uint32_t& enable, uint32_t bits) {
  enable = enable | bits;
  [[maybe_unused]] const uint32_t read_back = enable;
}

inline void enable_irq(uint32_t irq, uint8_t priority) {
  reinterpret_cast<volatile uint8_t*>(0xe000e400)[irq] = priority;
  at(0xe000e100 + 4 * (irq / 32)) = 1U << (irq % 32);
}
inline void pend_irq(uint32_t irq) { at(0xe000e200 + 4 * (irq / 32)) = 1U << (irq % 32); }

inline void wait_for_interrupt() { asm volatile("wfi"); }
inline void enable_fpu() {
  at(0xe000ed88) |= 0xf << 20;
  asm volatile("dsb\n isb" ::: "memory");
}

/// 168 MHz from an 8 MHz crystal, APB1 42 MHz, APB2 84 MHz; spins on the ready bits as start-up code does.
inline void clock_168_MHz() {
  flash.acr = 5;
  rcc.cr |= 1 << 16;
  while (!(rcc.cr & 1 << 17)) {
  }
  rcc.pllcfgr = 8 | 336 << 6 | 0 << 16 | 1 << 22 | 7 << 24 | 2 << 28;
  rcc.cr |= 1 << 24;
  while (!(rcc.cr & 1 << 25)) {
  }
  rcc.cfgr = 5 << 10 | 4 << 13 | 2;
  while ((rcc.cfgr & 0xc) != 8) {
  }
}
