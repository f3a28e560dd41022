#pragma once
// Why the controller started, and a number that no other start has.

#include "firmware/core/board.hpp"

namespace diastole::stm32 {

inline constexpr std::uint16_t kBoardId = 2;

/// Reads and clears the reset flags.
wire::ResetCause take_reset_cause();

/// From the hand-over that the bootloader left, and the random number generator, whose clock must be on.
firmware::Identity read_identity();

/// `starts` distinguishes starts even if the random generator does not run.
std::uint32_t make_boot_id(std::uint32_t starts);

}  // namespace diastole::stm32
