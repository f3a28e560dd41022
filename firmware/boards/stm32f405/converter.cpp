#include "firmware/boards/stm32f405/converter.hpp"

#include "firmware/boards/stm32f405/registers.hpp"
#include "firmware/core/units.hpp"

namespace diastole::stm32 {

namespace {

constexpr std::uint32_t kClock = 1U << 8, kOn = 1U << 0, kStart = 1U << 30, kEndOfConversion = 1U << 1;

}  // namespace

Converter::Converter(Reference reference) {
  constexpr std::uint32_t kQuarterOfApb2 = 1U << 16, kReferenceOn = 1U << 23;
  enable_clocks(rcc().APB2ENR, kClock);
  adc_common().CCR.write(kQuarterOfApb2 | (reference == Reference::on ? kReferenceOn : 0U));
  adc1().CR2.write(kOn);
  const std::uint32_t since = tim2().CNT.read();
  while (tim2().CNT.read() - since < firmware::lower_half(firmware::microseconds(12))) {
  }
}

Converter::~Converter() {
  rcc().APB2RSTR.set(kClock);
  rcc().APB2RSTR.clear(kClock);
  rcc().APB2ENR.clear(kClock);
}

std::uint32_t convert(unsigned channel, SamplingTime sampling) {
  adc1().SMPR[channel >= 10 ? 0 : 1].write(static_cast<std::uint32_t>(sampling) << 3 * (channel % 10));
  adc1().SQR[2].write(channel);
  adc1().CR2.set(kStart);
  while ((adc1().SR.read() & kEndOfConversion) == 0) {
  }
  return adc1().DR.read();
}

}  // namespace diastole::stm32
