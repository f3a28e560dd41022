#pragma once
// The system control space at 0xe000'e000: NVIC registers, system control block (vector table, reset request,
// fault status, FPU access, memory protection) and SysTick (ARMv7-M ARM, B3.2 to B3.5); and DWT with the cycle counter.

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

/// SysTick: the core's 24-bit down-counter (ARMv7-M ARM, B3.3). The reference clock is the core's over 8.
class SysTick final : public Device {
 public:
  SysTick(const Clock& clock, Scheduler& scheduler, Nvic& nvic)
      : clock_(clock), scheduler_(scheduler), nvic_(nvic), slot_(scheduler.add(*this)) {}

  /// Offsets 0x10 ... 0x1c, as in the system control space.
  std::optional<uint32_t> read(uint32_t offset) override {
    settle();
    switch (offset) {
      case 0x10: {
        const uint32_t value = control_ | (counted_ ? 1U << 16 : 0);
        counted_ = false;
        return value;
      }
      case 0x14:
        return reload_;
      case 0x18:
        return counting() ? static_cast<uint32_t>((zero_at_ - clock_.now()) / cycles_per_count()) : 0U;
      default:
        return {};
    }
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    settle();
    const bool ran = counting();
    if (offset == 0x10) control_ = merged(control_, value, mask) & 7;
    if (offset == 0x14) reload_ = merged(reload_, value, mask) & 0x00ff'ffff;
    if (offset == 0x18) counted_ = false;
    if (counting() && (!ran || offset == 0x18)) zero_at_ = clock_.now() + turn();
    ask();
  }
  void reset() override {
    control_ = reload_ = 0;
    counted_ = false;
    zero_at_ = never;
    ask();
  }
  void on_event(Cycles at) override {
    counted_ = true;
    zero_at_ = at + turn();
    nvic_.set_pending(exception::sys_tick);
    ask();
  }

 private:
  [[nodiscard]] Cycles cycles_per_count() const { return (control_ & 4) != 0 ? 1 : 8; }
  /// From one zero to the next.
  [[nodiscard]] Cycles turn() const { return (uint64_t{reload_} + 1) * cycles_per_count(); }
  [[nodiscard]] bool counting() const { return (control_ & 1) != 0 && reload_ != 0; }
  /// Without its interrupt nobody calls at zero: catch up when looked at.
  void settle() {
    if (!counting() || zero_at_ > clock_.now()) return;
    zero_at_ += ((clock_.now() - zero_at_) / turn() + 1) * turn();
    counted_ = true;
  }
  void ask() { scheduler_.set(slot_, counting() && (control_ & 2) != 0 ? zero_at_ : never); }

  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Scheduler::Slot slot_;
  uint32_t control_ = 0, reload_ = 0;
  bool counted_ = false;
  Cycles zero_at_ = never;  ///< when the counter next reaches zero
};

/// Bits of the configurable fault status register.
namespace fault_status {
inline constexpr uint32_t execute_denied = 1 << 0, data_denied = 1 << 1, stacking_denied = 1 << 4,
                          denied_address_valid = 1 << 7, instruction_access = 1 << 8, precise_data = 1 << 9,
                          imprecise_data = 1 << 10, address_valid = 1 << 15, undefined_instruction = 1 << 16,
                          invalid_state = 1 << 17, invalid_return = 1 << 18, no_coprocessor = 1 << 19;
}

class SystemControl final : public RegisterBlock {
 public:
  SystemControl(Nvic& nvic, SysTick& systick) : nvic_(nvic), systick_(systick) {}

  std::optional<uint32_t> read(uint32_t offset) override {
    const uint32_t word = (offset & 0x7f) / 4;
    if (offset >= 0x10 && offset < 0x20) return systick_.read(offset);
    if (offset == 0x004) return irq_count / 32;
    if (offset >= 0x100 && offset < 0x200) return bits_of(word, &Nvic::enabled);
    if (offset >= 0x200 && offset < 0x300) return bits_of(word, &Nvic::pending);
    if (offset >= 0x300 && offset < 0x400) return bits_of(word, &Nvic::is_active);
    if (offset >= 0x400 && offset < 0x400 + irq_count)
      return priorities(exception::first_irq + offset - 0x400);
    if (offset == 0xd00) return 0x410f'c241;  // Cortex-M4 r0p1
    if (offset == 0xd04) {
      uint32_t value = nvic_.best_pending() << 12;
      if (nvic_.pending(exception::pend_sv)) value |= 1U << 28;
      if (nvic_.pending(exception::sys_tick)) value |= 1U << 26;
      return value | nvic_.running();
    }
    if (offset == 0xd0c) return 0xfa05'0000 | nvic_.priority_grouping() << 8;
    if (offset >= 0xd18 && offset < 0xd24) return priorities(first_system_handler + offset - 0xd18);
    if (offset == 0xd90) return protection_regions << 8;
    if (offset == 0xd9c) return regions_[region_ % protection_regions].base | region_;
    if (offset == 0xda0) return regions_[region_ % protection_regions].attributes;
    return RegisterBlock::read(offset);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
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
    if (offset >= 0xd18 && offset < 0xd24)
      return set_priorities(first_system_handler + offset - 0xd18, value, mask);
    switch (offset) {
      case 0xd04:
        return write_interrupt_control(bits);
      case 0xd08:
        vtor_ = merged(vtor_, value, mask) & ~0x7fU;
        return;
      case 0xd0c:
        return write_application_control(bits);
      case 0xd28:
        cfsr_ &= ~bits;
        return;
      case 0xd2c:
        hfsr_ &= ~bits;
        return;
      case 0xd9c:
        if ((value & 1U << 4) != 0) region_ = value & 0xf;
        regions_[region_ % protection_regions].base = value & ~0x1fU;
        return protection_changed();
      case 0xda0:
        regions_[region_ % protection_regions].attributes = value;
        return protection_changed();
      case 0xd94:
        RegisterBlock::write(offset, value, mask);
        return protection_changed();
      case 0xf00:
        if ((bits & 0x1ff) < irq_count) nvic_.set_pending(exception::first_irq + (bits & 0x1ff));
        return;
      default:
        RegisterBlock::write(offset, value, mask);
    }
  }
  void reset() override {
    vtor_ = scr_ = shcsr_ = cfsr_ = hfsr_ = mmfar_ = bfar_ = cpacr_ = 0;
    ccr_ = 0x200;
    fpccr_ = 0xc000'0000;
    fpcar_ = fpdscr_ = demcr_ = mpu_control_ = region_ = 0;
    regions_.fill({});
    protection_changed();
    systick_.reset();
  }

  [[nodiscard]] uint32_t vector_table() const { return vtor_; }
  /// A region of the memory protection unit that counts; of overlapping ones the later in the list does.
  struct ProtectedRegion {
    uint32_t base = 0, bytes = 0;
    bool denied = false;  ///< neither read nor written
    bool never_executed = false;
  };
  [[nodiscard]] std::vector<ProtectedRegion> protected_regions() const {
    std::vector<ProtectedRegion> found;
    if ((mpu_control_ & 1) == 0) return found;
    for (const Region& region : regions_) {
      if ((region.attributes & 1) == 0) continue;
      const uint32_t bytes = 2U << (region.attributes >> 1 & 0x1f);
      found.push_back(
          {region.base, bytes, (region.attributes >> 24 & 7) == 0, (region.attributes >> 28 & 1) != 0});
    }
    return found;
  }
  void on_protection_change(std::function<void()> listener) { protection_listener_ = std::move(listener); }
  [[nodiscard]] bool fpu_enabled() const { return (cpacr_ >> 20 & 0xf) == 0xf; }
  [[nodiscard]] bool sleep_on_exit() const { return (scr_ & 2) != 0; }
  [[nodiscard]] bool fault_enabled(uint32_t number) const {
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
  void on_reset_request(std::function<void()> request) { reset_request_ = std::move(request); }

  void record_fault(uint32_t status_bits, uint32_t address = 0) {
    cfsr_ |= status_bits;
    if (status_bits & fault_status::address_valid) bfar_ = address;
    if (status_bits & fault_status::denied_address_valid) mmfar_ = address;
  }
  void record_escalation() { hfsr_ |= 1U << 30; }

 private:
  static constexpr uint32_t usage_enable = 1 << 18, bus_enable = 1 << 17, memory_enable = 1 << 16;

  /// System handler priority registers hold exceptions 4 ... 15, one byte each.
  static constexpr uint32_t first_system_handler = 4;

  uint32_t* word(uint32_t offset) override {
    const struct {
      uint32_t offset, *word;
    } places[] = {{0xd08, &vtor_},  {0xd10, &scr_},         {0xd14, &ccr_},    {0xd24, &shcsr_},
                  {0xd28, &cfsr_},  {0xd2c, &hfsr_},        {0xd34, &mmfar_},  {0xd38, &bfar_},
                  {0xd88, &cpacr_}, {0xd94, &mpu_control_}, {0xd98, &region_}, {0xdfc, &demcr_},
                  {0xf34, &fpccr_}, {0xf38, &fpcar_},       {0xf3c, &fpdscr_}};
    const auto* found =
        std::ranges::find_if(places, [&](const auto& place) { return place.offset == offset; });
    return found != std::end(places) ? found->word : nullptr;
  }
  void write_interrupt_control(uint32_t value) {
    if (value & 1U << 31) nvic_.set_pending(exception::nmi);
    if (value & 1U << 28) nvic_.set_pending(exception::pend_sv);
    if (value & 1U << 27) nvic_.clear_pending(exception::pend_sv);
    if (value & 1U << 26) nvic_.set_pending(exception::sys_tick);
    if (value & 1U << 25) nvic_.clear_pending(exception::sys_tick);
  }
  void write_application_control(uint32_t value) {
    if (value >> 16 != 0x05fa) return;
    nvic_.set_priority_grouping(value >> 8 & 7);
    if ((value & 4) != 0 && reset_request_) reset_request_();
  }
  [[nodiscard]] uint32_t bits_of(uint32_t word, bool (Nvic::*test)(uint32_t) const) const {
    uint32_t bits = 0;
    for (uint32_t bit = 0; bit < 32 && 32 * word + bit < irq_count; ++bit) {
      if ((nvic_.*test)(exception::first_irq + 32 * word + bit)) bits |= 1U << bit;
    }
    return bits;
  }
  void for_bits(uint32_t word, uint32_t bits, const std::function<void(uint32_t)>& action) {
    for (; bits != 0; bits &= bits - 1) {
      const uint32_t irq = 32 * word + static_cast<uint32_t>(std::countr_zero(bits));
      if (irq < irq_count) action(exception::first_irq + irq);
    }
  }
  [[nodiscard]] uint32_t priorities(uint32_t first) const {
    uint32_t value = 0;
    for (uint32_t i = 0; i < 4 && first + i < exception_count; ++i) {
      value |= uint32_t{nvic_.priority(first + i)} << (8 * i);
    }
    return value;
  }
  void set_priorities(uint32_t first, uint32_t value, uint32_t mask) {
    for (uint32_t i = 0; i < 4 && first + i < exception_count; ++i) {
      if ((mask >> (8 * i) & 0xff) != 0)
        nvic_.set_priority(first + i, static_cast<uint8_t>(value >> (8 * i)));
    }
  }

  static constexpr uint32_t protection_regions = 8;
  struct Region {
    uint32_t base = 0, attributes = 0;
  };
  void protection_changed() {
    if (protection_listener_) protection_listener_();
  }

  Nvic& nvic_;
  SysTick& systick_;
  std::function<void()> reset_request_, protection_listener_;
  std::array<Region, protection_regions> regions_{};
  uint32_t mpu_control_ = 0, region_ = 0;
  uint32_t vtor_ = 0, scr_ = 0, ccr_ = 0x200, shcsr_ = 0, cfsr_ = 0, hfsr_ = 0, mmfar_ = 0, bfar_ = 0,
           cpacr_ = 0;
  uint32_t fpccr_ = 0xc000'0000, fpcar_ = 0, fpdscr_ = 0, demcr_ = 0;
};

/// DWT: CTRL and CYCCNT.
class Dwt final : public Device {
 public:
  explicit Dwt(const Clock& clock) : clock_(clock) {}
  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset == 0) return control_;
    return offset == 4 ? std::optional(count()) : std::nullopt;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    held_ = count();
    since_ = clock_.now();
    if (offset == 0) control_ = merged(control_, value, mask);
    if (offset == 4) held_ = merged(held_, value, mask);
  }
  void reset() override {
    control_ = 0x4000'0000;
    held_ = 0;
    since_ = clock_.now();
  }

 private:
  [[nodiscard]] uint32_t count() const {
    return held_ + ((control_ & 1) != 0 ? static_cast<uint32_t>(clock_.now() - since_) : 0);
  }

  const Clock& clock_;
  uint32_t control_ = 0x4000'0000;
  uint32_t held_ = 0;
  Cycles since_ = 0;
};

}  // namespace diastole::board_model
