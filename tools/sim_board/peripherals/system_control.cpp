#include "tools/sim_board/peripherals/system_control.hpp"

#include <bit>

namespace diastole::board_model {
namespace {

constexpr uint32_t block_start = 0xd00, block_end = 0xdf0;
constexpr uint32_t usage_enable = 1 << 18, bus_enable = 1 << 17, memory_enable = 1 << 16;

/// System handler priority registers hold exceptions 4 ... 15, one byte each.
constexpr uint32_t first_system_handler = 4;

}  // namespace

SystemControl::SystemControl(Nvic& nvic, SysTick& systick) : nvic_(nvic), systick_(systick) {}

void SystemControl::reset() {
  vtor_ = scr_ = shcsr_ = cfsr_ = hfsr_ = mmfar_ = bfar_ = cpacr_ = 0;
  ccr_ = 0x200;
  fpccr_ = 0xc000'0000;
  fpcar_ = fpdscr_ = demcr_ = 0;
  systick_.reset();
}

bool SystemControl::fault_enabled(uint32_t number) const {
  switch (number) {
    case exception::mem_manage:
      return (shcsr_ & memory_enable) != 0;
    case exception::bus_fault:
      return (shcsr_ & bus_enable) != 0;
    case exception::usage_fault:
      return (shcsr_ & usage_enable) != 0;
    default:
      return true;
  }
}

void SystemControl::record_fault(uint32_t status_bits, uint32_t address) {
  cfsr_ |= status_bits;
  if (status_bits & fault_status::address_valid) bfar_ = address;
}

uint32_t SystemControl::bits_of(uint32_t word, bool (Nvic::*test)(uint32_t) const) const {
  uint32_t bits = 0;
  for (uint32_t bit = 0; bit < 32 && 32 * word + bit < irq_count; ++bit) {
    if ((nvic_.*test)(exception::first_irq + 32 * word + bit)) bits |= 1U << bit;
  }
  return bits;
}

void SystemControl::for_bits(uint32_t word, uint32_t bits, const std::function<void(uint32_t)>& action) {
  for (; bits != 0; bits &= bits - 1) {
    const uint32_t irq = 32 * word + static_cast<uint32_t>(std::countr_zero(bits));
    if (irq < irq_count) action(exception::first_irq + irq);
  }
}

uint32_t SystemControl::priorities(uint32_t first) const {
  uint32_t value = 0;
  for (uint32_t i = 0; i < 4 && first + i < exception_count; ++i) {
    value |= uint32_t{nvic_.priority(first + i)} << (8 * i);
  }
  return value;
}

void SystemControl::set_priorities(uint32_t first, uint32_t value, uint32_t mask) {
  for (uint32_t i = 0; i < 4 && first + i < exception_count; ++i) {
    if ((mask >> (8 * i) & 0xff) != 0) nvic_.set_priority(first + i, static_cast<uint8_t>(value >> (8 * i)));
  }
}

uint32_t SystemControl::read(uint32_t offset) {
  const uint32_t word = (offset & 0x7f) / 4;
  if (offset >= 0x10 && offset < 0x20) return systick_.read(offset);
  if (offset == 0x004) return irq_count / 32;
  if (offset >= 0x100 && offset < 0x200) return bits_of(word, &Nvic::enabled);
  if (offset >= 0x200 && offset < 0x300) return bits_of(word, &Nvic::pending);
  if (offset >= 0x300 && offset < 0x400) return bits_of(word, &Nvic::is_active);
  if (offset >= 0x400 && offset < 0x400 + irq_count) return priorities(exception::first_irq + offset - 0x400);
  if (offset >= block_start && offset < block_end) return read_block(offset);
  switch (offset) {
    case 0xdfc:
      return demcr_;
    case 0xf34:
      return fpccr_;
    case 0xf38:
      return fpcar_;
    case 0xf3c:
      return fpdscr_;
    default:
      return 0;
  }
}

void SystemControl::write(uint32_t offset, uint32_t value, uint32_t mask) {
  const uint32_t word = (offset & 0x7f) / 4;
  const uint32_t bits = value & mask;
  if (offset >= 0x10 && offset < 0x20) return systick_.write(offset, value, mask);
  if (offset >= 0x100 && offset < 0x180)
    return for_bits(word, bits, [&](uint32_t n) { nvic_.set_enabled(n, true); });
  if (offset >= 0x180 && offset < 0x200)
    return for_bits(word, bits, [&](uint32_t n) { nvic_.set_enabled(n, false); });
  if (offset >= 0x200 && offset < 0x280)
    return for_bits(word, bits, [&](uint32_t n) { nvic_.set_pending(n); });
  if (offset >= 0x280 && offset < 0x300)
    return for_bits(word, bits, [&](uint32_t n) { nvic_.clear_pending(n); });
  if (offset >= 0x400 && offset < 0x400 + irq_count) {
    return set_priorities(exception::first_irq + offset - 0x400, value, mask);
  }
  if (offset >= block_start && offset < block_end) return write_block(offset, value, mask);
  switch (offset) {
    case 0xdfc:
      demcr_ = merged(demcr_, value, mask);
      break;
    case 0xf00:
      if ((bits & 0x1ff) < irq_count) nvic_.set_pending(exception::first_irq + (bits & 0x1ff));
      break;
    case 0xf34:
      fpccr_ = merged(fpccr_, value, mask);
      break;
    case 0xf38:
      fpcar_ = merged(fpcar_, value, mask);
      break;
    case 0xf3c:
      fpdscr_ = merged(fpdscr_, value, mask);
      break;
    default:
      break;
  }
}

uint32_t SystemControl::read_block(uint32_t offset) const {
  switch (offset) {
    case 0xd00:
      return 0x410f'c241;  // Cortex-M4 r0p1
    case 0xd04: {
      uint32_t value = nvic_.best_pending() << 12;
      if (nvic_.pending(exception::pend_sv)) value |= 1U << 28;
      if (nvic_.pending(exception::sys_tick)) value |= 1U << 26;
      return value | nvic_.running();
    }
    case 0xd08:
      return vtor_;
    case 0xd0c:
      return 0xfa05'0000 | nvic_.priority_grouping() << 8;
    case 0xd10:
      return scr_;
    case 0xd14:
      return ccr_;
    case 0xd18:
    case 0xd1c:
    case 0xd20:
      return priorities(first_system_handler + offset - 0xd18);
    case 0xd24:
      return shcsr_;
    case 0xd28:
      return cfsr_;
    case 0xd2c:
      return hfsr_;
    case 0xd34:
      return mmfar_;
    case 0xd38:
      return bfar_;
    case 0xd88:
      return cpacr_;
    default:
      return 0;
  }
}

void SystemControl::write_block(uint32_t offset, uint32_t value, uint32_t mask) {
  switch (offset) {
    case 0xd04:
      write_interrupt_control(value & mask);
      break;
    case 0xd08:
      vtor_ = merged(vtor_, value, mask) & ~0x7fU;
      break;
    case 0xd0c:
      write_application_control(value & mask);
      break;
    case 0xd10:
      scr_ = merged(scr_, value, mask);
      break;
    case 0xd14:
      ccr_ = merged(ccr_, value, mask);
      break;
    case 0xd18:
    case 0xd1c:
    case 0xd20:
      set_priorities(first_system_handler + offset - 0xd18, value, mask);
      break;
    case 0xd24:
      shcsr_ = merged(shcsr_, value, mask);
      break;
    case 0xd28:
      cfsr_ &= ~(value & mask);
      break;
    case 0xd2c:
      hfsr_ &= ~(value & mask);
      break;
    case 0xd34:
      mmfar_ = merged(mmfar_, value, mask);
      break;
    case 0xd38:
      bfar_ = merged(bfar_, value, mask);
      break;
    case 0xd88:
      cpacr_ = merged(cpacr_, value, mask);
      break;
    default:
      break;
  }
}

void SystemControl::write_interrupt_control(uint32_t value) {
  if (value & 1U << 31) nvic_.set_pending(exception::nmi);
  if (value & 1U << 28) nvic_.set_pending(exception::pend_sv);
  if (value & 1U << 27) nvic_.clear_pending(exception::pend_sv);
  if (value & 1U << 26) nvic_.set_pending(exception::sys_tick);
  if (value & 1U << 25) nvic_.clear_pending(exception::sys_tick);
}

void SystemControl::write_application_control(uint32_t value) {
  if (value >> 16 != 0x05fa) return;
  nvic_.set_priority_grouping(value >> 8 & 7);
  if ((value & 4) != 0 && reset_request_) reset_request_();
}

uint32_t Dwt::count() const {
  return held_ + ((control_ & 1) != 0 ? static_cast<uint32_t>(clock_.now() - since_) : 0);
}

uint32_t Dwt::read(uint32_t offset) { return offset == 0 ? control_ : offset == 4 ? count() : 0; }

void Dwt::write(uint32_t offset, uint32_t value, uint32_t mask) {
  held_ = count();
  since_ = clock_.now();
  if (offset == 0) control_ = merged(control_, value, mask);
  if (offset == 4) held_ = merged(held_, value, mask);
}

void Dwt::reset() {
  control_ = 0x4000'0000;
  held_ = 0;
  since_ = clock_.now();
}

}  // namespace diastole::board_model
