#pragma once
// The chip: every device at its address, behind its clock gate, wired to the others.

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "tools/sim_board/core/world.hpp"
#include "tools/sim_board/peripherals/dac.hpp"
#include "tools/sim_board/peripherals/dma.hpp"
#include "tools/sim_board/peripherals/exti.hpp"
#include "tools/sim_board/peripherals/flash.hpp"
#include "tools/sim_board/peripherals/gpio.hpp"
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

  Chip(uint32_t crystal_Hz, uint32_t random_seed, Listeners listeners);

  /// Every device and the core to their reset state; the cause is kept in RCC_CSR.
  void reset(ResetCause cause);
  /// The serial port that the firmware has switched on, null when there is none.
  [[nodiscard]] Usart* serial();
  [[nodiscard]] uint64_t serial_overruns() const;

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
  Dac dac{clock, pins, notes};
  Watchdog watchdog{clock, scheduler};
  Dma dma1{1, bus, memory, nvic, notes};
  Dma dma2{2, bus, memory, nvic, notes};
  World world;
  std::vector<std::unique_ptr<Gpio>> ports;
  std::vector<std::unique_ptr<Timer>> timers;
  std::vector<std::unique_ptr<Usart>> usarts;
  Cpu cpu;

 private:
  void add_ports();
  void add_timers();
  void add_usarts();
  void add_others(uint32_t random_seed);
  void trigger_output(uint8_t timer, Cycles at);

  Listeners listeners_;
  std::vector<std::unique_ptr<Device>> others_;
};

}  // namespace diastole::board_model
