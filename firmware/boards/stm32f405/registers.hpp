#pragma once
// The registers of the STM32F405 that the firmware uses, as laid out in RM0090 (STM32F405/415, 407/417, …
// reference manual) and, for the core's own, in PM0214 (Cortex-M4 programming manual). Offsets are checked
// below.

#include <cstddef>
#include <cstdint>

namespace diastole::stm32 {

class Register {
 public:
  [[nodiscard]] std::uint32_t read() const { return value_; }
  void write(std::uint32_t value) { value_ = value; }
  void set(std::uint32_t bits) { value_ = value_ | bits; }
  void clear(std::uint32_t bits) { value_ = value_ & ~bits; }
  void change(std::uint32_t mask, std::uint32_t bits) { value_ = (value_ & ~mask) | bits; }

 private:
  volatile std::uint32_t value_;
};

/// Sets bits of one of RCC's enable registers and reads them back: a peripheral may not answer in the cycles after its clock
/// was enabled (errata sheet ES0182, 2.2.13).
inline void enable_clocks(Register& enable, std::uint32_t bits) {
  enable.set(bits);
  (void)enable.read();
}

struct Rcc {  // RM0090 7.3
  Register CR, PLLCFGR, CFGR, CIR, AHB1RSTR, AHB2RSTR, AHB3RSTR, reserved0, APB1RSTR, APB2RSTR, reserved1[2];
  Register AHB1ENR, AHB2ENR, AHB3ENR, reserved2, APB1ENR, APB2ENR, reserved3[11], CSR;
};
static_assert(offsetof(Rcc, AHB1ENR) == 0x30 && offsetof(Rcc, CSR) == 0x74);

struct FlashInterface {  // 3.9
  Register ACR, KEYR, OPTKEYR, SR, CR, OPTCR;
};
static_assert(offsetof(FlashInterface, OPTCR) == 0x14);

struct Power {  // 5.4
  Register CR, CSR;
};

struct Gpio {  // 8.4
  Register MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFR[2];
};
static_assert(offsetof(Gpio, AFR) == 0x20);

struct Timer {  // 18.4
  Register CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR, reserved0, CCR1, CCR2, CCR3,
      CCR4, BDTR, DCR, DMAR, OR;
};
static_assert(offsetof(Timer, CCR1) == 0x34 && offsetof(Timer, OR) == 0x50);

/// The flags of Timer::SR that there are: written as 1 they stay, as 0 they go; the bits between them are reserved.
inline constexpr std::uint32_t kTimerFlags = 0x1E5F;

struct Usart {  // 30.6
  Register SR, DR, BRR, CR1, CR2, CR3, GTPR;
};

struct Dac {  // 14.5
  Register CR, SWTRIGR, DHR12R1, reserved[10], SR;
};
static_assert(offsetof(Dac, SR) == 0x34);

struct Adc {  // 13.13
  Register SR, CR1, CR2, SMPR[2], JOFR[4], HTR, LTR, SQR[3], JSQR, JDR[4], DR;
};
static_assert(offsetof(Adc, DR) == 0x4C);

struct AdcCommon {  // 13.13.15
  Register CSR, CCR;
};

struct DmaStream {
  Register CR, NDTR, PAR, M0AR, M1AR, FCR;
};
struct Dma {  // 10.5
  Register LISR, HISR, LIFCR, HIFCR;
  DmaStream stream[8];
};
static_assert(offsetof(Dma, stream[5]) == 0x88);

struct Exti {  // 12.3
  Register IMR, EMR, RTSR, FTSR, SWIER, PR;
};

struct Syscfg {  // 9.2
  Register MEMRMP, PMC, EXTICR[4], CMPCR;
};

struct Iwdg {  // 21.4
  Register KR, PR, RLR, SR;
};

struct Rng {  // 24.4
  Register CR, SR, DR;
};

struct SysTick {  // PM0214 4.5
  Register CTRL, LOAD, VAL, CALIB;
};

struct Nvic {  // PM0214 4.3
  Register ISER[8], reserved0[24], ICER[8], reserved1[24], ISPR[8], reserved2[24], ICPR[8], reserved3[24];
  Register IABR[8], reserved4[56];
  volatile std::uint8_t IPR[240];
};
static_assert(offsetof(Nvic, IPR) == 0x300);

struct SystemControl {  // PM0214 4.4
  Register CPUID, ICSR, VTOR, AIRCR, SCR, CCR, SHPR[3], SHCSR, CFSR, HFSR, DFSR, MMFAR, BFAR;
};
static_assert(offsetof(SystemControl, BFAR) == 0x38);

struct MemoryProtection {  // PM0214 4.2
  Register TYPE, CTRL, RNR, RBAR, RASR;
};

struct Debug {  // RM0090 38.16
  Register IDCODE, CR, APB1_FZ, APB2_FZ;
};

struct CycleCounter {  // ARMv7-M ARM C1.8
  Register CTRL, CYCCNT;
};

template <class Peripheral>
Peripheral& at(std::uintptr_t address) {
  return *reinterpret_cast<Peripheral*>(address);
}

inline Rcc& rcc() { return at<Rcc>(0x4002'3800); }
inline FlashInterface& flash() { return at<FlashInterface>(0x4002'3C00); }
inline Power& power() { return at<Power>(0x4000'7000); }
inline Gpio& gpio_a() { return at<Gpio>(0x4002'0000); }
inline Gpio& gpio_b() { return at<Gpio>(0x4002'0400); }
inline Gpio& gpio_c() { return at<Gpio>(0x4002'0800); }
inline Timer& tim2() { return at<Timer>(0x4000'0000); }
inline Timer& tim3() { return at<Timer>(0x4000'0400); }
inline Timer& tim4() { return at<Timer>(0x4000'0800); }
inline Timer& tim5() { return at<Timer>(0x4000'0C00); }
inline Timer& tim9() { return at<Timer>(0x4001'4000); }
inline Timer& tim11() { return at<Timer>(0x4001'4800); }
inline Usart& usart3() { return at<Usart>(0x4000'4800); }
inline Dac& dac() { return at<Dac>(0x4000'7400); }
inline Adc& adc1() { return at<Adc>(0x4001'2000); }
inline AdcCommon& adc_common() { return at<AdcCommon>(0x4001'2300); }
inline Dma& dma1() { return at<Dma>(0x4002'6000); }
inline Exti& exti() { return at<Exti>(0x4001'3C00); }
inline Syscfg& syscfg() { return at<Syscfg>(0x4001'3800); }
inline Iwdg& iwdg() { return at<Iwdg>(0x4000'3000); }
inline Rng& rng() { return at<Rng>(0x5006'0800); }
inline SysTick& systick() { return at<SysTick>(0xE000'E010); }
inline SystemControl& system_control() { return at<SystemControl>(0xE000'ED00); }
inline MemoryProtection& mpu() { return at<MemoryProtection>(0xE000'ED90); }
inline Debug& debug() { return at<Debug>(0xE004'2000); }
inline CycleCounter& cycle_counter() { return at<CycleCounter>(0xE000'1000); }
/// DEMCR, ARMv7-M ARM C1.6.5.
inline Register& debug_monitor() { return at<Register>(0xE000'EDFC); }
inline Nvic& nvic() { return at<Nvic>(0xE000'E100); }

/// Interrupt numbers, RM0090 table 62.
enum Interrupt : unsigned {
  kExti0 = 6,
  kExti1 = 7,
  kExti2 = 8,
  kDma1Stream5 = 16,
  kTim2 = 28,
  kUsart3 = 39,
  kTim5 = 50
};

/// Priority 0 (first) … 15; equal priorities do not interrupt each other.
inline void enable_interrupt(Interrupt number, std::uint8_t priority) {
  nvic().IPR[number] = static_cast<std::uint8_t>(priority << 4);
  nvic().ISER[number / 32].write(1U << (number % 32));
}

/// While one of these lives the interrupt is not served, and what asked for it meanwhile is forgotten. It was enabled before.
class InterruptHeld {
 public:
  explicit InterruptHeld(Interrupt number) : number_(number) {
    nvic().ICER[number / 32].write(1U << (number % 32));
    asm volatile("dsb \n isb" ::: "memory");
  }
  ~InterruptHeld() {
    nvic().ICPR[number_ / 32].write(1U << (number_ % 32));
    nvic().ISER[number_ / 32].write(1U << (number_ % 32));
  }
  InterruptHeld(const InterruptHeld&) = delete;
  InterruptHeld& operator=(const InterruptHeld&) = delete;

 private:
  Interrupt number_;
};

}  // namespace diastole::stm32
