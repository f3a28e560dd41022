#pragma once
// A processor fault's registers in retained memory, from the handler to the start after it.

#include <optional>

#include "firmware/core/crash_record.hpp"

namespace diastole::stm32 {

/// Keeps fault status, the cycle counter and what the core stacked at `frame`; zeros for that if it could not stack it.
/// For the handler of a fault: its stack may be the one that overflowed, and nothing here waits.
void keep_crash(const std::uint32_t* frame);

/// The one kept since the last call, over resets.
std::optional<firmware::CrashRecord> take_crash();

/// The counter of core cycles that goes into the record; it begins at 0.
void start_cycle_counter();

}  // namespace diastole::stm32
