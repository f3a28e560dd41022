#include "tools/sim_board/peripherals/flash.hpp"

#include <algorithm>
#include <cstring>

namespace diastole::board_model {
namespace {

constexpr uint32_t locked = 0x8000'0000, start = 1 << 16, mass_erase = 1 << 2, sector_erase = 1 << 1,
                   program = 1;
constexpr uint32_t busy_flag = 1 << 16, end_of_operation = 1, parallelism_error = 1 << 6,
                   sequence_error = 1 << 7, alignment_error = 1 << 5;

// Typical times at x32 parallelism, datasheet 5.3.12.
constexpr uint64_t program_ns = 16'000;
constexpr uint64_t erase_16k_ns = 250'000'000, erase_64k_ns = 550'000'000, erase_128k_ns = 1'000'000'000,
                   erase_all_ns = 8'000'000'000;

uint64_t erase_ns(uint32_t bytes) {
  return bytes == 0x4000 ? erase_16k_ns : bytes == 0x1'0000 ? erase_64k_ns : erase_128k_ns;
}

}  // namespace

Sector flash_sector(uint32_t number) {
  if (number < 4) return {number * 0x4000, 0x4000};
  if (number == 4) return {0x1'0000, 0x1'0000};
  return {(number - 4) * 0x2'0000, 0x2'0000};
}

Flash::Flash(std::span<uint8_t> memory, const Clock& clock, Scheduler& scheduler, Notes& notes)
    : memory_(memory), clock_(clock), scheduler_(scheduler), notes_(notes), slot_(scheduler.add(*this)) {}

void Flash::reset() {
  acr_ = sr_ = 0;
  cr_ = locked;
  first_key_ = key_fault_ = busy_ = false;
  scheduler_.set(slot_, never);
}

uint32_t Flash::read(uint32_t offset) {
  switch (offset) {
    case 0x00:
      return acr_;
    case 0x0c:
      return sr_ | (busy_ ? busy_flag : 0);
    case 0x10:
      return cr_;
    case 0x14:
      return 0x0fff'aaed;
    default:
      return 0;
  }
}

void Flash::write(uint32_t offset, uint32_t value, uint32_t mask) {
  switch (offset) {
    case 0x00:
      acr_ = merged(acr_, value, mask);
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

void Flash::write_key(uint32_t key) {
  if (!first_key_ && key == 0x4567'0123) {
    first_key_ = true;
  } else if (first_key_ && key == 0xcdef'89ab && !key_fault_) {
    cr_ &= ~locked;
    first_key_ = false;
  } else {
    key_fault_ = true;  // locked until the next reset
  }
}

void Flash::write_control(uint32_t value) {
  if (cr_ & locked) return;
  if (busy_) return notes_.add("FLASH_CR written while busy", clock_.ns(clock_.now()));
  cr_ = value & ~start;
  if ((value & start) == 0) return;
  if (value & mass_erase) return erase(0, flash_bytes, erase_all_ns);
  const uint32_t number = value >> 3 & 0xf;
  if ((value & sector_erase) == 0 || number >= 12) {
    sr_ |= sequence_error;
    return;
  }
  const Sector sector = flash_sector(number);
  erase(sector.offset, sector.bytes, erase_ns(sector.bytes));
}

void Flash::erase(uint32_t first, uint32_t bytes, uint64_t duration_ns) {
  const bool whole = begin_operation(duration_ns);
  const uint32_t done = whole ? bytes : bytes / 2;
  std::fill_n(memory_.begin() + first, done, uint8_t{0xff});
  changed(first, bytes);
  if (!whole && listeners_.power_cut) listeners_.power_cut();
}

void Flash::store(uint32_t offset, uint32_t value, uint32_t bytes) {
  if (busy_) notes_.add("flash written while busy", clock_.ns(clock_.now()));
  if ((cr_ & locked) != 0 || (cr_ & program) == 0) {
    sr_ |= sequence_error;
    return notes_.add("store to flash without FLASH_CR.PG", clock_.ns(clock_.now()));
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

bool Flash::begin_operation(uint64_t duration_ns) {
  ++operations_;
  busy_ = true;
  busy_until_ = clock_.now() + clock_.cycles_in(duration_ns);
  scheduler_.set(slot_, busy_until_);
  return !cut_at_ || *cut_at_ != operations_;
}

void Flash::changed(uint32_t offset, uint32_t bytes) {
  if (listeners_.changed) listeners_.changed(offset, bytes);
}

void Flash::on_event(Cycles) {
  busy_ = false;
  sr_ |= end_of_operation;
}

void Flash::after_clock_change() {
  check_wait_states();
  if (busy_) scheduler_.set(slot_, busy_until_);
}

void Flash::check_wait_states() {
  // 2.7 to 3.6 V: one wait state for every 30 MHz begun (RM0090, table 10).
  if (clock_.tree().core_Hz > ((acr_ & 7) + 1) * 30'000'000) {
    notes_.add("FLASH_ACR.LATENCY too small for " + std::to_string(clock_.tree().core_Hz) + " Hz",
               clock_.ns(clock_.now()));
  }
}

}  // namespace diastole::board_model
