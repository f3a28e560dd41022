#pragma once
// The flash operations of an update on the emulated board, and the flash as a power cut in the middle of any of them
// leaves it. So every cut can be tried without running the update up to it each time; test_flashing.cpp shows for
// some that the emulator's own power cut leaves the same bytes.

#include <algorithm>
#include <cstring>
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

  /// The flash after a power cut in the middle of operation `cut`, the first being 1.
  [[nodiscard]] std::vector<uint8_t> cut_at(size_t cut) const {
    std::vector<uint8_t> flash = before_;
    for (size_t i = 0; i + 1 < cut; ++i)
      apply(flash, operations_[i]);
    const Operation& last = operations_[cut - 1];
    if (last.bytes != 4) {
      std::fill_n(flash.begin() + last.offset, last.bytes / 2, uint8_t{0xff});
    } else {
      uint32_t word = 0;
      std::memcpy(&word, &flash[last.offset], 4);
      word &= ~(word & ~last.value & 0x5555'5555);
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
