#pragma once
// The chip: every device at its address, behind its clock gate, wired to the others.

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/sim_board/core/world.hpp"
#include "tools/sim_board/peripherals/adc.hpp"
#include "tools/sim_board/peripherals/dac.hpp"
#include "tools/sim_board/peripherals/dma.hpp"
#include "tools/sim_board/peripherals/exti.hpp"
#include "tools/sim_board/peripherals/flash.hpp"
#include "tools/sim_board/peripherals/gpio.hpp"
#include "tools/sim_board/peripherals/power.hpp"
#include "tools/sim_board/peripherals/rcc.hpp"
#include "tools/sim_board/peripherals/storage.hpp"
#include "tools/sim_board/peripherals/timer.hpp"
#include "tools/sim_board/peripherals/usart.hpp"
#include "tools/sim_board/peripherals/watchdog.hpp"
#include "tools/sim_board/processor/cpu.hpp"

namespace diastole::board_model {

class Chip {
 public:
  struct Listeners {
    std::function<void(uint8_t byte, Cycles at)> sent;
    std::function<void(uint8_t timer, uint8_t channel, Cycles late_by)> missed;
    std::function<void(ResetCause)> reset_request;
    std::function<void()> power_cut;
    std::function<void(uint32_t offset, uint32_t bytes)> flash_changed;
  };

  Chip(uint32_t crystal_Hz, uint32_t random_seed, uint32_t device_id, FlashTiming timing, Listeners listeners)
      : rcc(clock, bus, scheduler, nvic, notes, crystal_Hz),
        flash(memory.flash(), clock, scheduler, notes),
        world(clock, scheduler,
              [this](Pin pin, bool level, Cycles at) { ports[pin.port]->drive(pin.number, level, at); }),
        cpu({clock, memory, bus, scheduler, nvic, control, flash, notes}, timing),
        listeners_(std::move(listeners)) {
    bus.add({"RCC", 0x4002'3800, {}, &rcc});
    bus.gate_by([this](ClockGate gate) { return rcc.clock_of(gate); });
    bus.add({"FLASH", 0x4002'3c00, {}, &flash});
    add_ports();
    add_timers();
    add_usarts();
    add_others(random_seed, device_id);
    flash.listen({[this](uint32_t offset, uint32_t bytes) {
                    cpu.forget_code(offset, bytes);
                    listeners_.flash_changed(offset, bytes);
                  },
                  [this] { listeners_.power_cut(); }});
    watchdog.on_bite([this] { listeners_.reset_request(ResetCause::independent_watchdog); });
    control.on_reset_request([this] { listeners_.reset_request(ResetCause::software); });
  }

  /// Every device and the core to their reset state; the cause is kept in RCC_CSR.
  void reset(ResetCause cause) {
    rcc.record(cause);
    bus.reset_all();
    flash.read_marginal_cells();
    nvic.reset();
    cpu.reset();
  }
  /// The serial port that the firmware has switched on, null when there is none.
  [[nodiscard]] Usart* serial() {
    const auto found = std::ranges::find_if(usarts, [](const auto& usart) { return usart->in_use(); });
    return found == usarts.end() ? nullptr : found->get();
  }
  [[nodiscard]] uint64_t serial_overruns() const {
    uint64_t sum = 0;
    for (const auto& usart : usarts)
      sum += usart->overruns();
    return sum;
  }

  Clock clock;
  Notes notes{clock};
  Memory memory;
  Scheduler scheduler;
  Nvic nvic{clock};
  PinLog pins{clock};
  Bus bus{notes};

  Rcc rcc;
  Flash flash;
  SysTick systick{clock, scheduler, nvic};
  SystemControl control{nvic, systick};
  Dwt dwt{clock};
  Syscfg syscfg;
  Exti exti{syscfg, pins, nvic};
  Power power;
  Dac dac{clock, pins, notes};
  Adc adc{clock, scheduler, notes};
  Watchdog watchdog{clock, scheduler};
  Dma dma1{1, bus, memory, nvic, notes};
  Dma dma2{2, bus, memory, nvic, notes};
  World world;
  std::map<uint32_t, std::function<double(uint64_t time_ns)>>
      analog;  ///< volts by pin index; others have none
  std::vector<std::unique_ptr<Gpio>> ports;
  std::vector<std::unique_ptr<Timer>> timers;
  std::vector<std::unique_ptr<Usart>> usarts;
  Cpu cpu;

 private:
  static constexpr uint32_t ahb1 = 0x30, ahb2 = 0x34, apb1 = 0x40, apb2 = 0x44;  // RCC enable registers

  struct TimerPlace {
    Timer::Shape shape;
    uint32_t base, gate_bit;
    /// Timers on internal triggers 0 ... 3 (RM0090, tables 93, 97, 101); 0: none.
    std::array<uint8_t, 4> triggers;
  };

  static constexpr TimerPlace timer_places[] = {
      {{1, false, true, 25, 27, 0}, 0x4001'0000, 0, {5, 2, 3, 4}},
      {{2, true, false, 28, 28, 0}, 0x4000'0000, 0, {1, 8, 3, 4}},
      {{3, false, false, 29, 29, 0}, 0x4000'0400, 1, {1, 2, 5, 4}},
      {{4, false, false, 30, 30, 0}, 0x4000'0800, 2, {1, 2, 3, 8}},
      {{5, true, false, 50, 50, 0}, 0x4000'0c00, 3, {2, 3, 4, 8}},
      {{6, false, false, 54, 54, 0}, 0x4000'1000, 4, {}},
      {{7, false, false, 55, 55, 0}, 0x4000'1400, 5, {}},
      {{8, false, true, 44, 46, 0}, 0x4001'0400, 1, {1, 2, 4, 5}},
      {{9, false, true, 24, 24, 0}, 0x4001'4000, 16, {2, 3, 10, 11}},
      {{10, false, true, 25, 25, 1}, 0x4001'4400, 17, {}},
      {{11, false, true, 26, 26, 0}, 0x4001'4800, 18, {}},
      {{12, false, false, 43, 43, 0}, 0x4000'1800, 6, {4, 5, 13, 14}},
      {{13, false, false, 44, 44, 1}, 0x4000'1c00, 7, {}},
      {{14, false, false, 45, 45, 0}, 0x4000'2000, 8, {}},
  };

  struct UsartPlace {
    Usart::Shape shape;
    uint32_t base, gate_bit;
  };

  static constexpr UsartPlace usart_places[] = {
      {{1, true, 37}, 0x4001'1000, 4},   {{2, false, 38}, 0x4000'4400, 17}, {{3, false, 39}, 0x4000'4800, 18},
      {{4, false, 52}, 0x4000'4c00, 19}, {{5, false, 53}, 0x4000'5000, 20}, {{6, true, 71}, 0x4001'1400, 5},
  };

  void add_ports() {
    for (uint8_t port = 0; port < port_count; ++port) {
      ports.push_back(std::make_unique<Gpio>(port, clock, pins));
      bus.add({std::string("GPIO") + static_cast<char>('A' + port),
               0x4002'0000U + 0x400U * port,
               {ahb1, port},
               ports.back().get()});
    }
  }
  void add_timers() {
    for (const TimerPlace& place : timer_places) {
      auto timer = std::make_unique<Timer>(place.shape, clock, scheduler, nvic, notes);
      const uint8_t number = place.shape.number;
      timer->wire(
          {[this, number](uint8_t channel, bool level, Cycles at) {
             for (const auto& port : ports)
               port->timer_level({number, channel}, level, at);
           },
           [this, number](Cycles at) { trigger_output(number, at); },
           [this, number](uint8_t channel, bool input, Cycles at) {
             for (const auto& port : ports)
               port->timer_direction({number, channel}, input, at);
           },
           [this, number](uint8_t channel, Cycles late_by) { listeners_.missed(number, channel, late_by); },
           number == 11 ? std::function<double()>([this] { return rcc.cycles_per_divided_crystal(); })
                        : std::function<double()>()});
      bus.add({"TIM" + std::to_string(number),
               place.base,
               {place.shape.on_apb2 ? apb2 : apb1, place.gate_bit},
               timer.get()});
      timers.push_back(std::move(timer));
    }
    pins.on_change([this](Pin pin, bool level, Cycles at) {
      const TimerOutput to = ports[pin.port]->timer_of(pin.number);
      for (const auto& timer : timers)
        if (timer->shape().number == to.timer) timer->pin_edge(to.channel - 1U, level, at);
    });
  }
  void add_usarts() {
    for (const UsartPlace& place : usart_places) {
      auto usart = std::make_unique<Usart>(place.shape, clock, scheduler, nvic);
      usart->on_sent([this](uint8_t byte, Cycles at) { listeners_.sent(byte, at); });
      bus.add({"USART" + std::to_string(place.shape.number),
               place.base,
               {place.shape.on_apb2 ? apb2 : apb1, place.gate_bit},
               usart.get()});
      usarts.push_back(std::move(usart));
    }
  }
  void add_others(uint32_t random_seed, uint32_t device_id) {
    bus.add({"SYSCFG", 0x4001'3800, {apb2, 14}, &syscfg});
    bus.add({"EXTI", 0x4001'3c00, {}, &exti});
    bus.add({"DAC", 0x4000'7400, {apb1, 29}, &dac});
    bus.add({"ADC1", 0x4001'2000, {apb2, 8}, &adc});
    adc.wire([this](uint32_t channel, Cycles at) { return analog_input(channel, at); });
    bus.add({"DMA1", 0x4002'6000, {ahb1, 21}, &dma1});
    bus.add({"DMA2", 0x4002'6400, {ahb1, 22}, &dma2});
    dac.on_dma_request([this](uint32_t channel) { dma1.request(5 + channel, 7); });
    bus.add({"IWDG", 0x4000'3000, {}, &watchdog});
    bus.add({"DWT", 0xe000'1000, {}, &dwt});
    bus.add({"system control", 0xe000'e000, {}, &control}, 4);
    const auto other = [&](const char* name, uint32_t base, ClockGate gate, std::unique_ptr<Device> device) {
      bus.add({name, base, gate, device.get()});
      others_.push_back(std::move(device));
    };
    bus.add({"PWR", 0x4000'7000, {apb1, 28}, &power});
    other("RTC", 0x4000'2800, {apb1, 28}, std::make_unique<Storage>(0, 0, true));
    other("DBGMCU", 0xe004'2000, {}, std::make_unique<Storage>(0, device_id));
    other("RNG", 0x5006'0800, {ahb2, 6}, std::make_unique<RandomNumbers>(random_seed));
  }
  /// Channels 0 to 15 of ADC1 (datasheet table 7).
  [[nodiscard]] std::optional<double> analog_input(uint32_t channel, Cycles at) const {
    constexpr Pin pins_of[] = {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {0, 4}, {0, 5}, {0, 6}, {0, 7},
                               {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}, {2, 3}, {2, 4}, {2, 5}};
    if (channel >= std::size(pins_of)) return {};
    const Pin pin = pins_of[channel];
    if (!ports[pin.port]->is_analog(pin.number)) return {};
    const auto driven = analog.find(pin.index());
    return driven == analog.end() ? 0 : driven->second(clock.ns(at));
  }
  void trigger_output(uint8_t timer, Cycles at) {
    dac.timer_trigger(timer, at);
    for (std::size_t index = 0; index < timers.size(); ++index) {
      const auto& triggers = timer_places[index].triggers;
      for (uint32_t input = 0; input < triggers.size(); ++input) {
        if (triggers[input] == timer) timers[index]->internal_trigger(input, at);
      }
    }
  }

  Listeners listeners_;
  std::vector<std::unique_ptr<Device>> others_;
};

}  // namespace diastole::board_model
