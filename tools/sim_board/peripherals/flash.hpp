#pragma once
// The 1 MB flash and its interface: unlocking, programming (bits only fall from 1 to 0), sector erase, busy
// times, error flags, and a power cut in the middle of an operation (RM0090, 3).
//
// Sectors: 0-3 16 KB, 4 64 KB, 5-11 128 KB. Operations are counted from the last power-up; one that the power
// cut hits is left half done: a word keeps every second bit that should have fallen, an erase clears the
// first half.
//
// Cells that were written below 2.7 V (32 bits at a time need that much), with randomise_cut_cells() those of an operation that
// the power cut hit, and those of make_marginal() are marginal: each reset reads them anew, a one or a zero, until the sector is
// erased or the word written as it should be. With randomise_cut_cells() an arbitrary part of a word's bits has fallen, and an
// erase may leave its sector reading blank. Option bytes (OPTCR) are kept as flash is, and count from the next reset on.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "tools/sim_board/core/memory.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Flash final : public RegisterBlock {
 public:
  Flash(std::span<uint8_t> memory, const Clock& clock, Scheduler& scheduler, Notes& notes)
      : memory_(memory), clock_(clock), scheduler_(scheduler), notes_(notes), slot_(scheduler.add(*this)) {}

  std::optional<uint32_t> read(uint32_t offset) override {
    return offset == 0x0c && busy_ ? sr_ | busy_flag : RegisterBlock::read(offset);
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
      case 0x08:
        write_option_key(value);
        break;
      case 0x10:
        write_control(merged(cr_, value, mask));
        break;
      case 0x14:
        write_options(merged(optcr_, value, mask));
        break;
      default:
        break;
    }
  }
  /// What a reset or a failing supply finds in progress is left half done.
  void reset() override {
    if (busy_ && clock_.now() < busy_until_ && !before_.empty()) break_off();
    acr_ = sr_ = 0;
    cr_ = locked;
    first_key_ = key_fault_ = busy_ = first_option_key_ = false;
    optcr_ = options_ | option_lock;
    loaded_options_ = options_;
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
    if (is_protected(offset)) {
      sr_ |= protection_error;
      return;
    }
    const bool whole = begin_operation(program_ns);
    keep_before(offset, bytes);
    const uint32_t old = word_of(before_.data(), bytes);
    const uint32_t programmed = old & value;
    std::memcpy(&memory_[offset], &programmed, bytes);
    if (supply_mV_ < least_supply_mV)
      marginal_[offset] |= old & ~value;
    else
      marginal_.erase(offset);
    changed(offset, bytes);
    if (!whole) cut();
  }

  /// FLASH_ACR.
  [[nodiscard]] uint32_t access_control() const { return acr_; }
  /// End of the operation in progress; 0 when idle. Code in flash stalls until then.
  [[nodiscard]] Cycles busy_until() const { return busy_ ? busy_until_ : 0; }

  [[nodiscard]] uint64_t operations() const { return operations_; }
  /// Power fails in the middle of operation number `operation` (1 is the first from now).
  void cut_power_at(std::optional<uint64_t> operation) {
    cut_at_ = operation ? std::optional(operations_ + *operation) : std::nullopt;
  }

  /// The voltage that operations have, and what a power cut leaves drawn from `seed`.
  void set_supply_mV(uint32_t supply_mV) { supply_mV_ = supply_mV; }
  void randomise_cut_cells(uint32_t seed) {
    randomised_ = true;
    random_.seed(seed);
  }
  /// A reset: marginal cells read anew.
  void read_marginal_cells() {
    for (const auto& [offset, bits] : marginal_) {
      uint32_t word = 0;
      std::memcpy(&word, &memory_[offset], 4);
      const auto drawn = static_cast<uint32_t>(random_());
      word = (word & ~bits) | (drawn & bits);
      std::memcpy(&memory_[offset], &word, 4);
      changed(offset, 4);
    }
  }
  /// These bits of the word at `offset`, a multiple of 4, are marginal from now on, as cells that wear out.
  void make_marginal(uint32_t offset, uint32_t bits) { marginal_[offset] |= bits; }
  [[nodiscard]] uint64_t broken_off() const { return broken_off_; }
  [[nodiscard]] std::size_t marginal_words() const { return marginal_.size(); }
  /// A supply that falls below the first is held in reset until it has risen to the second.
  struct BrownOut {
    uint32_t falling_mV, rising_mV;
  };
  /// As the options say that counted since the last reset; thresholds typical, datasheet table 19.
  [[nodiscard]] BrownOut brown_out() const {
    constexpr BrownOut levels[] = {
        {2830, 2920}, {2500, 2590}, {2190, 2290}, {1680, 1720}};  // BOR level 3, 2, 1, off: power-on reset
    return levels[loaded_options_ >> 2 & 3];
  }
  [[nodiscard]] uint32_t option_bytes() const { return options_; }

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
  static constexpr uint32_t option_lock = 1, option_start = 2, option_bits = 0x0fff'ffec;
  static constexpr uint32_t least_supply_mV = 2700;  // of x32, datasheet table 39
  static constexpr uint32_t protection_error = 1 << 4;
  static constexpr uint32_t busy_flag = 1 << 16, end_of_operation = 1, parallelism_error = 1 << 6,
                            sequence_error = 1 << 7, alignment_error = 1 << 5;

  // Typical times at x32 parallelism, datasheet 5.3.12.
  static constexpr uint64_t program_ns = 16'000;
  static constexpr uint64_t erase_16k_ns = 250'000'000, erase_64k_ns = 550'000'000,
                            erase_128k_ns = 1'000'000'000, erase_all_ns = 8'000'000'000;

  static uint64_t erase_ns(uint32_t bytes) {
    return bytes == 0x4000 ? erase_16k_ns : bytes == 0x1'0000 ? erase_64k_ns : erase_128k_ns;
  }

  uint32_t* word(uint32_t offset) override {
    return in_order(offset, {&acr_, nullptr, nullptr, &sr_, &cr_, &optcr_});
  }
  [[nodiscard]] bool is_protected(uint32_t offset) const {
    const uint32_t number = offset < 0x1'0000   ? offset / 0x4000
                            : offset < 0x2'0000 ? 4
                                                : 4 + offset / 0x2'0000;
    return (loaded_options_ >> (16 + number) & 1) == 0;
  }
  void write_option_key(uint32_t key) {
    if (first_option_key_ && key == 0x4c5d'6e7f) optcr_ &= ~option_lock;
    first_option_key_ = key == 0x0819'2a3b;
  }
  void write_options(uint32_t value) {
    if (optcr_ & option_lock) return;
    optcr_ = value & (option_bits | option_lock);
    if ((value & option_start) == 0) return;
    if (busy_) return notes_.add("option bytes written while flash is busy");
    if (supply_mV_ < least_supply_mV) notes_.add("option bytes written below 2.7 V");
    before_.clear();
    if (begin_operation(program_ns))
      options_ = value & option_bits;
    else if (listeners_.power_cut)
      listeners_.power_cut();
  }
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
    if (is_protected(first)) {
      sr_ |= protection_error;
      return;
    }
    const bool whole = begin_operation(duration_ns);
    keep_before(first, bytes);
    std::fill_n(memory_.begin() + first, bytes, uint8_t{0xff});
    marginal_.erase(marginal_.lower_bound(first), marginal_.lower_bound(first + bytes));
    if (supply_mV_ < least_supply_mV) weaken(first, bytes);
    changed(first, bytes);
    if (!whole) cut();
  }
  void keep_before(uint32_t first, uint32_t bytes) {
    before_at_ = first;
    before_.assign(memory_.begin() + first, memory_.begin() + first + bytes);
    const auto weak = marginal_.find(first);
    marginal_before_ = weak == marginal_.end() ? 0 : weak->second;
  }
  static uint32_t word_of(const uint8_t* place, uint32_t bytes) {
    uint32_t word = 0;
    std::memcpy(&word, place, bytes);
    return word;
  }
  /// Single bits of an erase that are neither.
  void weaken(uint32_t first, uint32_t bytes) {
    constexpr uint32_t words_a_weak_bit = 16;
    for (uint32_t at = first; at < first + bytes; at += 4 * words_a_weak_bit)
      marginal_[at + 4 * static_cast<uint32_t>(random_() % words_a_weak_bit)] = 1U << random_() % 32;
  }
  /// The operation in progress, or just begun, ends in its middle: some bits of a word have fallen, half of a sector is erased.
  void break_off() {
    ++broken_off_;
    const auto bytes = static_cast<uint32_t>(before_.size());
    if (bytes <= 4) {
      const uint32_t old = word_of(before_.data(), bytes);
      const uint32_t falling = old & ~word_of(&memory_[before_at_], bytes);
      const uint32_t left =
          old & ~(falling & (randomised_ ? static_cast<uint32_t>(random_()) : 0x5555'5555U));
      std::memcpy(&memory_[before_at_], &left, bytes);
      const uint32_t weak = marginal_before_ | (randomised_ ? falling : 0);
      if (weak != 0) make_marginal(before_at_, weak);
    } else {
      const uint32_t done = randomised_ && random_() % 2 == 0 ? bytes : bytes / 2;
      std::copy(before_.begin() + done, before_.end(), memory_.begin() + before_at_ + done);
      if (randomised_) weaken(before_at_, bytes);
    }
    changed(before_at_, bytes);
    busy_ = false;
  }
  void cut() {
    break_off();
    if (listeners_.power_cut) listeners_.power_cut();
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
  uint32_t acr_ = 0, sr_ = 0, cr_ = 0x8000'0000, optcr_ = 0x0fff'aaed;
  uint32_t options_ = 0x0fff'aaec;         ///< as they leave the factory: no brown-out reset, no protection
  uint32_t loaded_options_ = 0x0fff'aaec;  ///< as they were at the last reset
  uint32_t supply_mV_ = 3300;
  std::map<uint32_t, uint32_t> marginal_;  ///< bits by the offset of their word
  bool randomised_ = false, first_option_key_ = false;
  std::mt19937 random_{405};
  bool first_key_ = false, key_fault_ = false;
  bool busy_ = false;
  Cycles busy_until_ = 0;
  uint64_t operations_ = 0, broken_off_ = 0;
  uint32_t before_at_ = 0;
  std::vector<uint8_t> before_;   ///< what the last operation found
  uint32_t marginal_before_ = 0;  ///< ... of its first word
  std::optional<uint64_t> cut_at_;
};

}  // namespace diastole::board_model
