#pragma once
// The system control space at 0xe000'e000: NVIC registers, system control block (vector table, reset request,
// fault status, FPU access) and SysTick (ARMv7-M ARM, B3.2 to B3.4); and DWT with the cycle counter.

#include <array>
#include <cstdint>
#include <functional>

#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/peripherals/systick.hpp"

namespace diastole::board_model {

/// Bits of the configurable fault status register.
namespace fault_status {
inline constexpr uint32_t instruction_access = 1 << 8, precise_data = 1 << 9, imprecise_data = 1 << 10,
                          address_valid = 1 << 15, undefined_instruction = 1 << 16, invalid_state = 1 << 17,
                          invalid_return = 1 << 18, no_coprocessor = 1 << 19;
}

class SystemControl final : public RegisterBlock {
 public:
  SystemControl(Nvic& nvic, SysTick& systick);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;

  [[nodiscard]] uint32_t vector_table() const { return vtor_; }
  [[nodiscard]] bool fpu_enabled() const { return (cpacr_ >> 20 & 0xf) == 0xf; }
  [[nodiscard]] bool sleep_on_exit() const { return (scr_ & 2) != 0; }
  [[nodiscard]] bool fault_enabled(uint32_t number) const;
  void on_reset_request(std::function<void()> request) { reset_request_ = std::move(request); }

  void record_fault(uint32_t status_bits, uint32_t address = 0);
  void record_escalation() { hfsr_ |= 1U << 30; }

 private:
  uint32_t* word(uint32_t offset) override;
  void write_interrupt_control(uint32_t value);
  void write_application_control(uint32_t value);
  [[nodiscard]] uint32_t bits_of(uint32_t word, bool (Nvic::*test)(uint32_t) const) const;
  void for_bits(uint32_t word, uint32_t bits, const std::function<void(uint32_t)>& action);
  [[nodiscard]] uint32_t priorities(uint32_t first) const;
  void set_priorities(uint32_t first, uint32_t value, uint32_t mask);

  Nvic& nvic_;
  SysTick& systick_;
  std::function<void()> reset_request_;
  uint32_t vtor_ = 0, scr_ = 0, ccr_ = 0x200, shcsr_ = 0, cfsr_ = 0, hfsr_ = 0, mmfar_ = 0, bfar_ = 0,
           cpacr_ = 0;
  uint32_t fpccr_ = 0xc000'0000, fpcar_ = 0, fpdscr_ = 0, demcr_ = 0;
};

/// DWT: CTRL and CYCCNT.
class Dwt final : public Device {
 public:
  explicit Dwt(const Clock& clock) : clock_(clock) {}
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;

 private:
  [[nodiscard]] uint32_t count() const;

  const Clock& clock_;
  uint32_t control_ = 0x4000'0000;
  uint32_t held_ = 0;
  Cycles since_ = 0;
};

}  // namespace diastole::board_model
