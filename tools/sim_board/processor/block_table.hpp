#pragma once
// How many instructions a translated block holds: the emulator reports a block's address and bytes only.
//
// Thumb code mixes 2- and 4-byte instructions; a first halfword of 0b11101, 0b11110 or 0b11111 in its top
// five bits starts a long one (ARMv7-M ARM, A5.1). Counts are kept per start address.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace diastole::board_model {

struct Block {
  uint16_t bytes = 0;
  uint16_t instructions = 0;
  uint16_t before_float = no_float;        ///< instructions ahead of the first that needs the FPU
  uint16_t bytes_before_float = no_float;  ///< and their bytes

  static constexpr uint16_t no_float = 0xffff;
};

/// Blocks of one executable memory, which it only looks at.
class BlockTable {
 public:
  explicit BlockTable(std::span<const uint8_t> memory) : memory_(memory), blocks_(memory.size() / 2) {}

  /// Block of `bytes` bytes starting at `offset` into the memory.
  const Block& at(std::size_t offset, uint32_t bytes) {
    Block& block = blocks_[offset / 2];
    if (block.bytes != bytes) decode(block, offset, bytes);
    return block;
  }

  /// Forgets blocks that may contain any of [offset, offset + length).
  void forget(std::size_t offset, std::size_t length) {
    const std::size_t from = offset > longest_block_bytes ? offset - longest_block_bytes : 0;
    const std::size_t to = std::min(offset + length, memory_.size());
    std::fill(blocks_.begin() + static_cast<std::ptrdiff_t>(from / 2),
              blocks_.begin() + static_cast<std::ptrdiff_t>(to / 2), Block{});
  }

 private:
  static constexpr std::size_t longest_block_bytes = 4096;  // the translator never crosses a page

  static bool is_long(uint32_t first) { return (first >> 11) >= 0b11101; }

  /// Coprocessor 10 or 11 is the FPU: 111x 11xx xxxx xxxx | xxxx 101x xxxx xxxx.
  static bool is_float(uint32_t first, uint32_t second) {
    return (first & 0xec00) == 0xec00 && (second & 0x0e00) == 0x0a00;
  }

  void decode(Block& block, std::size_t offset, uint32_t bytes) const {
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
  [[nodiscard]] uint32_t halfword(std::size_t offset) const {
    return static_cast<uint32_t>(memory_[offset] | memory_[offset + 1] << 8);
  }

  std::span<const uint8_t> memory_;
  std::vector<Block> blocks_;
};

}  // namespace diastole::board_model
