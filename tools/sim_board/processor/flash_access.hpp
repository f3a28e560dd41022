#pragma once
// What the flash's wait states cost the core. The flash is read in lines of 16 bytes, each LATENCY cycles late; before it lie
// a cache of 64 lines for instructions, one of 8 for data, and a prefetch of the line that follows (RM0090, 3.5.2: both caches
// replace what has not been used for longest). How well they do on a real chip is not known to the cycle, hence three answers:
//
//   hits     as if everything were in the caches: the best that can be
//   cached   the caches as the manual describes them
//   misses   as if there were none, nor a prefetch: every line, every jump and every read of data waits; nothing is worse
//
// Time is brought up to date block by block (cpu.hpp), so a block waits at its beginning for all of its lines.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>

#include "tools/sim_board/core/clock.hpp"

namespace diastole::board_model {

enum class FlashTiming : uint8_t { hits, cached, misses };

/// Lines of 16 bytes; what has not been used for longest goes first.
class LineCache {
 public:
  explicit LineCache(std::size_t lines) : lines_(lines) {}

  /// True if the line was there; it is afterwards.
  bool use(uint32_t line) {
    const auto found = std::find(held_.begin(), held_.end(), line);
    const bool hit = found != held_.end();
    if (hit) {
      held_.splice(held_.begin(), held_, found);
      return true;
    }
    held_.push_front(line);
    if (held_.size() > lines_) held_.pop_back();
    return false;
  }
  void clear() { held_.clear(); }

 private:
  std::size_t lines_;
  std::list<uint32_t> held_;  ///< the newest first
};

class FlashAccess {
 public:
  explicit FlashAccess(FlashTiming timing) : timing_(timing) {}

  [[nodiscard]] bool counts() const { return timing_ != FlashTiming::hits; }

  /// FLASH_ACR as it is now.
  void set_control(uint32_t access_control) {
    if (((access_control ^ control_) & caches_and_resets) != 0) {
      instructions_.clear();
      data_.clear();
    }
    control_ = access_control;
  }

  /// Cycles that the core waits for a block of code at this offset of the flash.
  Cycles block(uint32_t offset, uint32_t bytes, uint32_t instructions) {
    const uint32_t first = offset / line_bytes, last = (offset + bytes - 1) / line_bytes;
    const bool goes_on = offset == next_offset_;
    next_offset_ = offset + bytes;
    Cycles waited = 0;
    for (uint32_t line = first; line <= last; ++line) {
      if (goes_on && line == first && line == last_line_) continue;  // it is being executed
      const bool hit = on(instruction_cache) && timing_ == FlashTiming::cached && instructions_.use(line);
      if (hit) continue;
      const bool follows = line > first || (goes_on && line == last_line_ + 1);
      const bool prefetched = follows && on(prefetch) && timing_ == FlashTiming::cached;
      waited += prefetched ? latency() - std::min(latency(), line_cycles(bytes, instructions)) : latency();
    }
    last_line_ = last;
    return waited;
  }

  /// Cycles that the core waits for data at this offset.
  Cycles read(uint32_t offset) {
    const bool hit = on(data_cache) && timing_ == FlashTiming::cached && data_.use(offset / line_bytes);
    return hit ? 0 : latency();
  }

 private:
  static constexpr uint32_t line_bytes = 16;
  static constexpr uint32_t prefetch = 1U << 8, instruction_cache = 1U << 9, data_cache = 1U << 10;
  static constexpr uint32_t caches_and_resets = 0x1eU << 8;

  [[nodiscard]] bool on(uint32_t bit) const { return (control_ & bit) != 0; }
  [[nodiscard]] Cycles latency() const { return control_ & 7U; }
  /// How long a line is executed, at this block's density of instructions: the prefetch of the next one has that time.
  static Cycles line_cycles(uint32_t bytes, uint32_t instructions) {
    return std::max(1U, line_bytes * instructions / std::max(1U, bytes));
  }

  FlashTiming timing_;
  uint32_t control_ = 0;
  uint32_t next_offset_ = ~0U, last_line_ = ~0U;
  LineCache instructions_{64}, data_{8};
};

}  // namespace diastole::board_model
