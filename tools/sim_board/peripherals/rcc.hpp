#pragma once
// RCC: oscillators and PLL with their ready bits, the clock tree, clock gates and resets of the peripherals,
// and the flags that show why the last reset happened (RM0090, 7.3).

#include <functional>

#include "tools/sim_board/core/bus.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

/// Bits of RCC_CSR.
enum class ResetCause : uint32_t {
  pin = 1U << 26,
  power = 1U << 27,  ///< also sets the brown-out flag
  software = 1U << 28,
  independent_watchdog = 1U << 29,
};

class Rcc final : public Device, public Gates {
 public:
  Rcc(Clock& clock, Bus& bus, Scheduler& scheduler, Notes& notes, uint32_t crystal_Hz);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;
  void on_event(Cycles at) override;

  [[nodiscard]] bool clocked(ClockGate gate) const override;
  /// Adds to the flags of RCC_CSR, which survive every reset but that of power.
  void record(ResetCause cause);

 private:
  static constexpr uint32_t register_words = 0x90 / 4;

  void write_control(uint32_t value);
  void write_configuration(uint32_t value);
  void apply_tree();
  [[nodiscard]] uint32_t pll_Hz();
  [[nodiscard]] uint32_t system_Hz();
  void check_range(const char* what, uint64_t value_Hz, uint64_t least_Hz, uint64_t most_Hz);

  Clock& clock_;
  Bus& bus_;
  Scheduler& scheduler_;
  Notes& notes_;
  Scheduler::Slot slot_;
  uint32_t crystal_Hz_;
  std::array<uint32_t, register_words> registers_{};
  uint32_t csr_ = 0;
  Cycles external_ready_ = never, pll_ready_ = never;
};

}  // namespace diastole::board_model
