#include "firmware/boards/stm32f405/pins.hpp"

#include <initializer_list>

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

namespace {

enum Mode : std::uint32_t { kInput = 0, kOutput = 1, kAlternate = 2, kAnalog = 3 };

void set_mode(Gpio& port, unsigned pin, Mode mode) { port.MODER.change(3U << (2 * pin), mode << (2 * pin)); }

void set_alternate(Gpio& port, unsigned pin, std::uint32_t function) {
  port.AFR[pin / 8].change(0xFU << (4 * (pin % 8)), function << (4 * (pin % 8)));
  port.OSPEEDR.change(3U << (2 * pin), 2U << (2 * pin));
  set_mode(port, pin, kAlternate);
}

}  // namespace

void configure_pins() {
  gpio_b().BSRR.write((kEnablePin | kFaultPin) << 16);
  set_mode(gpio_b(), 0, kOutput);
  set_mode(gpio_b(), 1, kOutput);
  for (const unsigned pin : {1U, 2U})
    set_alternate(gpio_a(), pin, 1);
  set_alternate(gpio_a(), 6, 2);
  set_mode(gpio_a(), 4, kAnalog);
  set_alternate(gpio_b(), 10, 7);
  set_alternate(gpio_b(), 11, 7);
  gpio_b().PUPDR.change(3U << 22, 1U << 22);  // RX idles high without a cable
  for (const unsigned pin : {0U, 1U, 2U}) {
    gpio_c().PUPDR.change(3U << (2 * pin), 1U << (2 * pin));
    set_mode(gpio_c(), pin, kInput);
  }
  constexpr std::uint32_t kInputs = kEstopPin | kHomePin | kFarLimitPin;
  syscfg().EXTICR[0].change(0xFFFU, 0x222U);  // EXTI0 … 2 from port C
  exti().RTSR.set(kInputs);
  exti().FTSR.set(kInputs);
  exti().PR.write(kInputs);
  exti().IMR.set(kInputs);
}

}  // namespace diastole::stm32
