#include "firmware/boards/stm32f405/r_wave_player.hpp"

#include <algorithm>

#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/core/r_wave.hpp"

namespace diastole::stm32 {

using firmware::kRWaveSamples;

namespace {

constexpr std::uint32_t kStreamEnable = 1U << 0;
constexpr std::uint32_t kDacDma = 1U << 12, kDacUnderrun = 1U << 13;
constexpr std::uint32_t kStream5Flags = 0x3DU << 6;  // in HIFCR
constexpr std::uint32_t kTriggerMode = 6U;           // SMS: started by the trigger

}  // namespace

void RWavePlayer::start() {
  // The output buffer does not reach below 0.2 V; the triangle starts at 0.
  constexpr std::uint32_t kEnable = 1U << 0, kBufferOff = 1U << 1, kTriggerEnable = 1U << 2,
                          kFromTim4 = 5U << 3;
  dac().DHR12R1.write(0);
  dac().CR.write(kEnable | kBufferOff | kTriggerEnable | kFromTim4 | kDacDma);
  tim4().PSC.write(0);
  tim4().ARR.write(reload_);
  tim4().CR2.write(2U << 4);   // TRGO = update
  tim4().SMCR.write(1U << 4);  // ITR1 = TIM2's TRGO, slave mode off
  enable_interrupt(kDma1Stream5, 3);
}

void RWavePlayer::use(const firmware::SignalSettings& signals) {
  const firmware::RWaveCodes codes = firmware::r_wave_codes(signals.r_wave_uV);
  std::ranges::copy(codes, codes_.begin());
  reload_ = static_cast<std::uint32_t>(firmware::r_wave_sample_period(signals.r_wave_us).count - 1);
}

void RWavePlayer::arm() {
  constexpr std::uint32_t kDacRequest = 7U << 25, kWords = 2U << 11 | 2U << 13, kIncrement = 1U << 10,
                          kToPeripheral = 1U << 6, kCompleteInterrupt = 1U << 4;
  DmaStream& stream = dma1().stream[5];
  stream.CR.write(0);
  while ((stream.CR.read() & kStreamEnable) != 0) {
  }
  dma1().HIFCR.write(kStream5Flags);
  // If the end of the last wave was served late, TIM4 asked for codes that nobody brought (RM0090 14.3.7).
  dac().CR.clear(kDacDma);
  dac().SR.write(kDacUnderrun);
  dac().CR.set(kDacDma);
  stream.PAR.write(reinterpret_cast<std::uintptr_t>(&dac().DHR12R1));
  stream.M0AR.write(reinterpret_cast<std::uintptr_t>(&codes_[1]));
  stream.NDTR.write(kRWaveSamples);
  dac().DHR12R1.write(codes_[0]);
  stream.CR.write(kDacRequest | kWords | kIncrement | kToPeripheral | kCompleteInterrupt | kStreamEnable);
  // The first update, and with it the first code, comes one tick after the trigger.
  tim4().ARR.write(reload_);
  tim4().CNT.write(reload_);
  tim4().SMCR.change(7U, kTriggerMode);
}

void RWavePlayer::arm_with(std::uint16_t first_code) {
  arm();
  dac().DHR12R1.write(first_code);
}

void RWavePlayer::hold(std::uint16_t code) {
  interrupt();
  DmaStream& stream = dma1().stream[5];
  stream.CR.write(0);
  while ((stream.CR.read() & kStreamEnable) != 0) {
  }
  dma1().HIFCR.write(kStream5Flags);
  dac().CR.clear(kDacDma);  // no request stays behind (errata sheet ES0182, 2.5.1)
  dac().DHR12R1.write(code);
  tim4().EGR.write(1);  // TRGO, which moves the code to the output
  dac().CR.set(kDacDma);
}

void RWavePlayer::disarm() { tim4().SMCR.change(7U, 0); }

void RWavePlayer::interrupt() {
  dma1().HIFCR.write(kStream5Flags);
  tim4().SMCR.change(7U, 0);
  tim4().CR1.write(0);
}

}  // namespace diastole::stm32
