#pragma once
// Why the controller started, and a number that no other start has.

#include "firmware/core/board.hpp"

namespace diastole::stm32 {

/// Reads and clears the reset flags; call once.
firmware::Identity read_identity();

}  // namespace diastole::stm32
