#pragma once
// What bootloader and application pass to each other over a reset, at the start of the retained memory
// (memory_map.hpp). It has a CRC, because memory is arbitrary after power-on.

#include <cstdint>
#include <optional>

#include "firmware/boards/stm32f405/memory_map.hpp"
#include "protocol/wire/states.hpp"

namespace diastole::stm32 {

enum class HandOverCommand : std::uint32_t {
  none = 0,
  stay = 1,   ///< application to bootloader: serve an update
  start = 2,  ///< bootloader to itself: the slot verifies, enter it from a clean reset
};

struct HandOver {
  HandOverCommand command = HandOverCommand::none;
  std::uint32_t slot = 0;   ///< wire::ImageSlot of what is, or is to be, started
  std::uint32_t trial = 0;  ///< 1: not confirmed yet
  wire::ResetCause reset_cause = wire::ResetCause::unknown;  ///< of the reset before the bootloader's own
  std::uint32_t starts = 0;                                  ///< resets since power-on
};

/// Nothing after power-on.
std::optional<HandOver> read_hand_over();
void write_hand_over(const HandOver& hand_over);

/// Resets the chip.
[[noreturn]] void reset();

}  // namespace diastole::stm32
