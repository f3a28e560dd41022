#include "tools/sim_board/processor/block_table.hpp"

#include <algorithm>

namespace diastole::board_model {
namespace {

constexpr std::size_t longest_block_bytes = 4096;  // the translator never crosses a page

bool is_long(uint32_t first) { return (first >> 11) >= 0b11101; }

/// Coprocessor 10 or 11 is the FPU: 111x 11xx xxxx xxxx | xxxx 101x xxxx xxxx.
bool is_float(uint32_t first, uint32_t second) {
  return (first & 0xec00) == 0xec00 && (second & 0x0e00) == 0x0a00;
}

}  // namespace

void BlockTable::decode(Block& block, std::size_t offset, uint32_t bytes) const {
  block = {static_cast<uint16_t>(bytes), 0, Block::no_float, Block::no_float};
  const std::size_t end = std::min(offset + bytes, memory_.size());
  for (std::size_t at = offset; at + 1 < end;) {
    const uint32_t first = halfword(at);
    const bool is_wide = is_long(first) && at + 3 < memory_.size();
    if (is_wide && block.before_float == Block::no_float && is_float(first, halfword(at + 2))) {
      block.before_float = block.instructions;
      block.bytes_before_float = static_cast<uint16_t>(at - offset);
    }
    ++block.instructions;
    at += is_wide ? 4 : 2;
  }
}

void BlockTable::forget(std::size_t offset, std::size_t length) {
  const std::size_t from = offset > longest_block_bytes ? offset - longest_block_bytes : 0;
  const std::size_t to = std::min(offset + length, memory_.size());
  std::fill(blocks_.begin() + static_cast<std::ptrdiff_t>(from / 2),
            blocks_.begin() + static_cast<std::ptrdiff_t>(to / 2), Block{});
}

}  // namespace diastole::board_model
