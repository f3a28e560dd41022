#pragma once
// RCC: oscillators and PLL with their ready bits, the clock tree, clock gates and resets of the peripherals,
// and the flags that show why the last reset happened (RM0090, 7.3).

#include <algorithm>
#include <optional>

#include "tools/sim_board/core/bus.hpp"
#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

/// Bits of RCC_CSR.
enum class ResetCause : uint32_t {
  pin = 1U << 26,
  power = 1U << 27,  ///< also sets the brown-out flag
  software = 1U << 28,
  independent_watchdog = 1U << 29,
};

class Rcc final : public RegisterBlock {
 public:
  /// A crystal of 0 Hz never starts.
  Rcc(Clock& clock, Bus& bus, Scheduler& scheduler, Nvic& nvic, Notes& notes, uint32_t crystal_Hz)
      : clock_(clock),
        bus_(bus),
        scheduler_(scheduler),
        nvic_(nvic),
        notes_(notes),
        slot_(scheduler.add(*this)),
        crystal_Hz_(crystal_Hz) {
    reset();
  }

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset == csr) return csr_ | (csr_ & 1) << 1;  // LSI is ready at once
    if (is_enable(offset)) enabled_lately(offset).bits = 0;
    return RegisterBlock::read(offset);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (word(offset) == nullptr) return;
    if (offset == cir) {
      if ((value & mask) >> 23 & 1) registers_[cir / 4] &= ~security_flag;
      return;
    }
    const uint32_t whole = merged(*read(offset), value, mask);
    if (offset == cr) return write_control(whole);
    if (offset == cfgr) return write_configuration(whole);
    if (offset == csr) {
      if (whole & remove_flags) csr_ &= 0x00ff'ffff;
      csr_ = (csr_ & ~1U) | (whole & 1);
      return;
    }
    if (is_enable(offset)) enabled_lately(offset) = {whole & ~registers_[offset / 4], clock_.now()};
    registers_[offset / 4] = whole;
    if (offset >= ahb1rstr && offset <= apb2rstr) bus_.reset_gated(offset + 0x20, value & mask);
  }
  void reset() override {
    registers_.fill(0);
    registers_[cr / 4] = 0x83;
    registers_[pllcfgr / 4] = 0x2400'3010;
    registers_[0x30 / 4] = 0x0010'0000;
    for (const auto [offset, value] : low_power_resets)
      registers_[offset / 4] = value;
    external_ready_ = pll_ready_ = never;
    enabled_lately_.fill({});
    scheduler_.set(slot_, never);
    apply_tree();
  }
  void on_event(Cycles at) override {
    if (external_ready_ <= at) {
      registers_[cr / 4] |= hse_ready;
      external_ready_ = never;
    }
    if (pll_ready_ <= at) {
      registers_[cr / 4] |= pll_ready;
      pll_ready_ = never;
    }
    scheduler_.set(slot_, std::min(external_ready_, pll_ready_));
  }

  /// The crystal stops, for good. With the clock security system on (CR.CSSON) the core goes on with the internal
  /// oscillator, in its NMI.
  void fail_crystal() {
    crystal_Hz_ = 0;
    uint32_t& held = registers_[cr / 4];
    const bool in_use = (held & hse_ready) != 0;
    held &= ~hse_ready;
    external_ready_ = never;
    if (!in_use) return;
    if ((held & security_on) == 0)
      return notes_.add("the crystal failed and nobody watched: the core stands still");
    held &= ~(hse_on | security_on);
    if ((registers_[pllcfgr / 4] >> 22 & 1) != 0) held &= ~(pll_on | pll_ready);
    registers_[cir / 4] |= security_flag;
    registers_[cfgr / 4] &= ~0xfU;
    apply_tree();
    nvic_.set_pending(exception::nmi);
  }
  /// Cycles of the core between two edges of the crystal's clock for the RTC (CFGR.RTCPRE), which TIM11 can capture; 0: none.
  [[nodiscard]] double cycles_per_divided_crystal() const {
    const uint32_t divider = registers_[cfgr / 4] >> 16 & 0x1f;
    if (divider < 2 || (registers_[cr / 4] & hse_ready) == 0) return 0;
    return static_cast<double>(clock_.tree().core_Hz) * divider / crystal_Hz_;
  }

  /// A clock has come up once its enable register has been read, or after as many cycles as the errata sheet says (ES0182,
  /// 2.2.13). Time is that of a block of instructions: within the block that enables it, only the reading counts.
  [[nodiscard]] ClockState clock_of(ClockGate gate) const {
    if (gate.enable_offset == 0) return ClockState::on;
    if ((registers_[gate.enable_offset / 4] >> gate.bit & 1) == 0) return ClockState::off;
    const EnabledLately& lately = enabled_lately_[(gate.enable_offset - ahb1enr) / 4];
    const bool comes_up =
        (lately.bits >> gate.bit & 1) != 0 && clock_.now() < lately.at + enable_delay(gate.enable_offset);
    return comes_up ? ClockState::coming_up : ClockState::on;
  }
  /// Adds to the flags of RCC_CSR, which survive every reset but that of power.
  void record(ResetCause cause) {
    const auto bits = static_cast<uint32_t>(cause);
    if (cause == ResetCause::power) csr_ = bits | 1U << 25;
    csr_ |= bits | static_cast<uint32_t>(ResetCause::pin);  // internal resets pull NRST low too
  }

 private:
  struct Reset {
    uint32_t offset, value;
  };
  static constexpr Reset low_power_resets[] = {{0x50, 0x7e67'91ff}, {0x54, 0xf1},        {0x58, 0x1},
                                               {0x60, 0x36fe'c9ff}, {0x64, 0x0007'5f33}, {0x84, 0x2000'3000}};
  static constexpr uint32_t security_on = 1 << 19, security_flag = 1 << 7;
  static constexpr uint32_t cr = 0x00, pllcfgr = 0x04, cfgr = 0x08, cir = 0x0c, ahb1rstr = 0x10,
                            apb2rstr = 0x24, ahb1enr = 0x30, apb1enr = 0x40, apb2enr = 0x44, csr = 0x74;
  static constexpr uint32_t hsi_on = 1, hsi_ready = 2, hse_on = 1 << 16, hse_ready = 1 << 17,
                            pll_on = 1 << 24, pll_ready = 1 << 25;
  static constexpr uint32_t remove_flags = 1 << 24;
  static constexpr uint32_t internal_Hz = 16'000'000;
  static constexpr uint64_t crystal_start_ns = 500'000,
                            pll_lock_ns = 100'000;  // typical, datasheet 5.3.9 and 5.3.10

  /// HPRE: 0xxx undivided, then 2, 4, 8, 16, 64, 128, 256, 512.
  static uint32_t core_divider(uint32_t code) {
    constexpr uint32_t dividers[] = {2, 4, 8, 16, 64, 128, 256, 512};
    return code < 8 ? 1 : dividers[code - 8];
  }

  /// PPREx: 0xx undivided, then 2, 4, 8, 16.
  static uint32_t bus_divider(uint32_t code) { return code < 4 ? 1 : 2U << (code - 4); }

  /// A timer's kernel runs at twice the bus clock unless the bus is undivided (TIMPRE = 0).
  static uint32_t timer_ratio(uint32_t bus_ratio) { return bus_ratio == 1 ? 1 : bus_ratio / 2; }

  struct EnabledLately {
    uint32_t bits = 0;  ///< set at `at`, and the register not read since
    Cycles at = 0;
  };
  static bool is_enable(uint32_t offset) { return offset >= ahb1enr && offset <= apb2enr; }
  EnabledLately& enabled_lately(uint32_t offset) { return enabled_lately_[(offset - ahb1enr) / 4]; }
  [[nodiscard]] Cycles enable_delay(uint32_t offset) const {
    return offset == apb1enr   ? 1 + clock_.tree().apb1_ratio
           : offset == apb2enr ? 1 + clock_.tree().apb2_ratio
                               : 2;
  }

  static constexpr uint32_t register_words = 0x90 / 4;

  uint32_t* word(uint32_t offset) override { return in_order(offset, registers_); }
  void write_control(uint32_t value) {
    uint32_t& held = registers_[cr / 4];
    held = (held & (hse_ready | pll_ready | hsi_ready)) | (value & ~(hse_ready | pll_ready | hsi_ready));
    const Cycles now = clock_.now();
    if (!(held & hse_on)) {
      held &= ~hse_ready;
      external_ready_ = never;
    } else if (!(held & hse_ready) && external_ready_ == never && crystal_Hz_ != 0) {
      external_ready_ = now + clock_.cycles_in(crystal_start_ns);
    }
    if (!(held & pll_on)) {
      held &= ~pll_ready;
      pll_ready_ = never;
    } else if (!(held & pll_ready) && pll_ready_ == never) {
      pll_ready_ = now + clock_.cycles_in(pll_lock_ns);
    }
    held = (held & hsi_on) ? held | hsi_ready : held & ~hsi_ready;
    scheduler_.set(slot_, std::min(external_ready_, pll_ready_));
  }
  void write_configuration(uint32_t value) {
    const uint32_t source = value & 3;
    constexpr uint32_t ready_bits[] = {hsi_ready, hse_ready, pll_ready, 0};
    uint32_t& held = registers_[cfgr / 4];
    const bool switches = (registers_[cr / 4] & ready_bits[source]) != 0;
    if (!switches) notes_.add("RCC_CFGR.SW asks for a clock that is not ready");
    held = (value & ~0xcU) | (switches ? source << 2 : held & 0xc);
    apply_tree();
  }
  void apply_tree() {
    const uint32_t configuration = registers_[cfgr / 4];
    ClockTree tree;
    tree.core_Hz = system_Hz() / core_divider(configuration >> 4 & 0xf);
    tree.apb1_ratio = bus_divider(configuration >> 10 & 7);
    tree.apb2_ratio = bus_divider(configuration >> 13 & 7);
    tree.apb1_timer_ratio = timer_ratio(tree.apb1_ratio);
    tree.apb2_timer_ratio = timer_ratio(tree.apb2_ratio);
    if (tree == clock_.tree()) return;
    check_range("core clock", tree.core_Hz, 0, 168'000'000);
    check_range("APB1", tree.core_Hz / tree.apb1_ratio, 0, 42'000'000);
    check_range("APB2", tree.core_Hz / tree.apb2_ratio, 0, 84'000'000);
    for (const Bus::Place& place : bus_.places())
      place.device->before_clock_change();
    clock_.set_tree(tree);
    for (const Bus::Place& place : bus_.places())
      place.device->after_clock_change();
  }
  [[nodiscard]] uint32_t pll_Hz() {
    const uint32_t configuration = registers_[pllcfgr / 4];
    const uint32_t m = std::max(configuration & 0x3f, 2U);
    const uint32_t n = configuration >> 6 & 0x1ff;
    const uint32_t p = 2 * ((configuration >> 16 & 3) + 1);
    const uint32_t input = (configuration >> 22 & 1) ? crystal_Hz_ : internal_Hz;
    check_range("PLL input", input / m, 950'000, 2'100'000);
    check_range("PLL oscillator", uint64_t{input} / m * n, 100'000'000, 432'000'000);
    return static_cast<uint32_t>(uint64_t{input} * n / m / p);
  }
  [[nodiscard]] uint32_t system_Hz() {
    switch (registers_[cfgr / 4] >> 2 & 3) {
      case 1:
        return crystal_Hz_;
      case 2:
        return pll_Hz();
      default:
        return internal_Hz;
    }
  }
  void check_range(const char* what, uint64_t value_Hz, uint64_t least_Hz, uint64_t most_Hz) {
    if (value_Hz >= least_Hz && value_Hz <= most_Hz) return;
    notes_.add(std::string(what) + " at " + std::to_string(value_Hz) + " Hz is outside the datasheet's " +
               std::to_string(least_Hz) + " to " + std::to_string(most_Hz) + " Hz");
  }

  Clock& clock_;
  Bus& bus_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Notes& notes_;
  Scheduler::Slot slot_;
  uint32_t crystal_Hz_;
  std::array<uint32_t, register_words> registers_{};
  std::array<EnabledLately, (apb2enr - ahb1enr) / 4 + 1> enabled_lately_{};
  uint32_t csr_ = 0;
  Cycles external_ready_ = never, pll_ready_ = never;
};

}  // namespace diastole::board_model
