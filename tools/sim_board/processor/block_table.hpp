#pragma once
// How many instructions a translated block holds: the emulator tells a block's address and bytes only.
//
// Thumb code mixes 2- and 4-byte instructions; a first halfword of 0b11101, 0b11110 or 0b11111 in its top
// five bits starts a long one (ARMv7-M ARM, A5.1). Counts are kept per start address.

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
  void forget(std::size_t offset, std::size_t length);

 private:
  void decode(Block& block, std::size_t offset, uint32_t bytes) const;
  [[nodiscard]] uint32_t halfword(std::size_t offset) const {
    return static_cast<uint32_t>(memory_[offset] | memory_[offset + 1] << 8);
  }

  std::span<const uint8_t> memory_;
  std::vector<Block> blocks_;
};

}  // namespace diastole::board_model
