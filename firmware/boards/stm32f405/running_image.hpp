#pragma once
// The application's view of the slot that it runs from.

#include "firmware/core/board.hpp"

namespace diastole::stm32 {

/// From this slot's header and the bootloader's hand-over.
firmware::RunningImage running_image();

/// Whether the bootloader was built without a key.
bool takes_unsigned_firmware();

/// Records that this image is the one to start from now on. Stalls the core for 0.1 ms.
bool confirm_running_image();

/// Resets; the bootloader then serves an update, or starts what is to be started.
[[noreturn]] void restart(bool into_bootloader);

}  // namespace diastole::stm32
