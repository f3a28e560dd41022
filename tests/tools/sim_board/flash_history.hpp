#pragma once
// The flash operations of an update on the emulated board, and the flash as a power cut in the middle of any of them
// leaves it. So every cut can be tried without running the update up to it each time; test_flash_power_cuts.cpp shows for
// some that the emulator's own power cut leaves the same bytes.

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "tools/sim_board/sim_board.hpp"

namespace diastole::sim_board_test {

class FlashHistory {
 public:
  /// Takes the board's flash as it is, and every operation from now on.
  explicit FlashHistory(SimBoard& board) : before_(board.flash().begin(), board.flash().end()) {
    board.on_flash_change([this, &board](uint32_t offset, uint32_t bytes) {
      uint32_t value = 0xffff'ffff;
      if (bytes == 4) std::memcpy(&value, &board.flash()[offset], 4);
      operations_.push_back({offset, bytes, value});
    });
  }

  [[nodiscard]] size_t operations() const { return operations_.size(); }

  /// The flash after a power cut in the middle of operation `cut`, the first being 1. With `cells` an arbitrary part of a word's
  /// bits has fallen; of an erased sector half or all reads blank, but for single bits. Without, every second bit and half.
  [[nodiscard]] std::vector<uint8_t> cut_at(size_t cut, std::mt19937* cells = nullptr) const {
    std::vector<uint8_t> flash = before_;
    for (size_t i = 0; i + 1 < cut; ++i)
      apply(flash, operations_[i]);
    const Operation& last = operations_[cut - 1];
    if (last.bytes != 4) {
      const uint32_t done = cells != nullptr && (*cells)() % 2 == 0 ? last.bytes : last.bytes / 2;
      std::fill_n(flash.begin() + last.offset, done, uint8_t{0xff});
      constexpr uint32_t bytes_a_weak_bit = 64;
      for (uint32_t at = 0; cells != nullptr && at < last.bytes; at += bytes_a_weak_bit)
        flash[last.offset + at + (*cells)() % bytes_a_weak_bit] ^= static_cast<uint8_t>(1U << (*cells)() % 8);
    } else {
      uint32_t word = 0;
      std::memcpy(&word, &flash[last.offset], 4);
      word &= ~(word & ~last.value & (cells != nullptr ? static_cast<uint32_t>((*cells)()) : 0x5555'5555U));
      std::memcpy(&flash[last.offset], &word, 4);
    }
    return flash;
  }

 private:
  struct Operation {
    uint32_t offset, bytes, value;
  };
  static void apply(std::vector<uint8_t>& flash, const Operation& operation) {
    if (operation.bytes == 4)
      std::memcpy(&flash[operation.offset], &operation.value, 4);
    else
      std::fill_n(flash.begin() + operation.offset, operation.bytes, uint8_t{0xff});
  }

  std::vector<uint8_t> before_;
  std::vector<Operation> operations_;
};

/// Makes the board's flash hold these bytes, touching only pages that differ. The board must be off.
inline void put_flash(SimBoard& board, const std::vector<uint8_t>& wanted) {
  constexpr size_t page = 0x1000;
  for (size_t at = 0; at < wanted.size(); at += page) {
    const auto now = board.flash().subspan(at, page);
    const std::span<const uint8_t> then(wanted.data() + at, page);
    if (!std::ranges::equal(now, then)) board.load(then, 0x0800'0000 + static_cast<uint32_t>(at));
  }
}

}  // namespace diastole::sim_board_test
