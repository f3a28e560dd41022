#pragma once
// The 1 MB flash and its interface: unlocking, programming (bits only fall from 1 to 0), sector erase, busy
// times, error flags, and a power cut in the middle of an operation (RM0090, 3).
//
// Sectors: 0-3 16 KB, 4 64 KB, 5-11 128 KB. Operations are counted from the last power-up; one that the power
// cut hits is left half done: a word keeps every second bit that should have fallen, an erase clears the
// first half.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <span>

#include "tools/sim_board/core/memory.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Flash final : public RegisterBlock {
 public:
  Flash(std::span<uint8_t> memory, const Clock& clock, Scheduler& scheduler, Notes& notes)
      : memory_(memory), clock_(clock), scheduler_(scheduler), notes_(notes), slot_(scheduler.add(*this)) {}

  uint32_t read(uint32_t offset) override {
    if (offset == 0x14) return 0x0fff'aaed;
    return RegisterBlock::read(offset) | (offset == 0x0c && busy_ ? busy_flag : 0);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    switch (offset) {
      case 0x00:
        RegisterBlock::write(offset, value, mask);
        check_wait_states();
        break;
      case 0x04:
        write_key(value);
        break;
      case 0x0c:
        sr_ &= ~(value & mask);
        break;
      case 0x10:
        write_control(merged(cr_, value, mask));
        break;
      default:
        break;
    }
  }
  void reset() override {
    acr_ = sr_ = 0;
    cr_ = locked;
    first_key_ = key_fault_ = busy_ = false;
    scheduler_.set(slot_, never);
  }
  void on_event(Cycles) override {
    busy_ = false;
    sr_ |= end_of_operation;
  }
  void after_clock_change() override {
    check_wait_states();
    if (busy_) scheduler_.set(slot_, busy_until_);
  }

  /// A store of the program to [0x0800'0000, +1 MB): programs when CR.PG allows it, else sets an error flag.
  void store(uint32_t offset, uint32_t value, uint32_t bytes) {
    if (busy_) notes_.add("flash written while busy");
    if ((cr_ & locked) != 0 || (cr_ & program) == 0) {
      sr_ |= sequence_error;
      return notes_.add("store to flash without FLASH_CR.PG");
    }
    if (bytes != 1U << (cr_ >> 8 & 3)) {
      sr_ |= parallelism_error;
      return;
    }
    if (offset % bytes != 0) {
      sr_ |= alignment_error;
      return;
    }
    const bool whole = begin_operation(program_ns);
    uint32_t old = 0;
    std::memcpy(&old, &memory_[offset], bytes);
    const uint32_t falling = old & ~value;
    const uint32_t left = whole ? old & value : old & ~(falling & 0x5555'5555);
    std::memcpy(&memory_[offset], &left, bytes);
    changed(offset, bytes);
    if (!whole && listeners_.power_cut) listeners_.power_cut();
  }

  /// End of the operation in progress; 0 when idle. Code in flash stalls until then.
  [[nodiscard]] Cycles busy_until() const { return busy_ ? busy_until_ : 0; }

  [[nodiscard]] uint64_t operations() const { return operations_; }
  /// Power fails in the middle of operation number `operation` (1 is the first from now).
  void cut_power_at(std::optional<uint64_t> operation) {
    cut_at_ = operation ? std::optional(operations_ + *operation) : std::nullopt;
  }

  struct Listeners {
    std::function<void(uint32_t offset, uint32_t bytes)> changed;  ///< contents: translations must go
    std::function<void()> power_cut;
  };
  void listen(Listeners listeners) { listeners_ = std::move(listeners); }

 private:
  struct Sector {
    uint32_t offset, bytes;
  };

  /// Precondition: number < 12.
  static Sector sector(uint32_t number) {
    if (number < 4) return {number * 0x4000, 0x4000};
    if (number == 4) return {0x1'0000, 0x1'0000};
    return {(number - 4) * 0x2'0000, 0x2'0000};
  }

  static constexpr uint32_t locked = 0x8000'0000, start = 1 << 16, mass_erase = 1 << 2, sector_erase = 1 << 1,
                            program = 1;
  static constexpr uint32_t busy_flag = 1 << 16, end_of_operation = 1, parallelism_error = 1 << 6,
                            sequence_error = 1 << 7, alignment_error = 1 << 5;

  // Typical times at x32 parallelism, datasheet 5.3.12.
  static constexpr uint64_t program_ns = 16'000;
  static constexpr uint64_t erase_16k_ns = 250'000'000, erase_64k_ns = 550'000'000,
                            erase_128k_ns = 1'000'000'000, erase_all_ns = 8'000'000'000;

  static uint64_t erase_ns(uint32_t bytes) {
    return bytes == 0x4000 ? erase_16k_ns : bytes == 0x1'0000 ? erase_64k_ns : erase_128k_ns;
  }

  uint32_t* word(uint32_t offset) override { return in_order(offset, {&acr_, nullptr, nullptr, &sr_, &cr_}); }
  void write_key(uint32_t key) {
    if (!first_key_ && key == 0x4567'0123) {
      first_key_ = true;
    } else if (first_key_ && key == 0xcdef'89ab && !key_fault_) {
      cr_ &= ~locked;
      first_key_ = false;
    } else {
      key_fault_ = true;  // locked until the next reset
    }
  }
  void write_control(uint32_t value) {
    if (cr_ & locked) return;
    if (busy_) return notes_.add("FLASH_CR written while busy");
    cr_ = value & ~start;
    if ((value & start) == 0) return;
    if (value & mass_erase) return erase(0, flash_bytes, erase_all_ns);
    const uint32_t number = value >> 3 & 0xf;
    if ((value & sector_erase) == 0 || number >= 12) {
      sr_ |= sequence_error;
      return;
    }
    const auto [first, bytes] = sector(number);
    erase(first, bytes, erase_ns(bytes));
  }
  void erase(uint32_t first, uint32_t bytes, uint64_t duration_ns) {
    const bool whole = begin_operation(duration_ns);
    const uint32_t done = whole ? bytes : bytes / 2;
    std::fill_n(memory_.begin() + first, done, uint8_t{0xff});
    changed(first, bytes);
    if (!whole && listeners_.power_cut) listeners_.power_cut();
  }
  bool begin_operation(uint64_t duration_ns) {
    ++operations_;
    busy_ = true;
    busy_until_ = clock_.now() + clock_.cycles_in(duration_ns);
    scheduler_.set(slot_, busy_until_);
    return !cut_at_ || *cut_at_ != operations_;
  }
  void changed(uint32_t offset, uint32_t bytes) {
    if (listeners_.changed) listeners_.changed(offset, bytes);
  }
  void check_wait_states() {
    // 2.7 to 3.6 V: one wait state for every 30 MHz begun (RM0090, table 10).
    if (clock_.tree().core_Hz > ((acr_ & 7) + 1) * 30'000'000) {
      notes_.add("FLASH_ACR.LATENCY too small for " + std::to_string(clock_.tree().core_Hz) + " Hz");
    }
  }

  std::span<uint8_t> memory_;
  const Clock& clock_;
  Scheduler& scheduler_;
  Notes& notes_;
  Scheduler::Slot slot_;
  Listeners listeners_;
  uint32_t acr_ = 0, sr_ = 0, cr_ = 0x8000'0000;
  bool first_key_ = false, key_fault_ = false;
  bool busy_ = false;
  Cycles busy_until_ = 0;
  uint64_t operations_ = 0;
  std::optional<uint64_t> cut_at_;
};

}  // namespace diastole::board_model
