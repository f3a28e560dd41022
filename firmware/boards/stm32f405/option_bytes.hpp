#pragma once
// What the chip must keep outside of its programs (RM0090 3.6): brown-out reset level 3, which resets the chip when the supply
// falls to 2.75 to 2.88 V, 2.83 typically, before the 2.7 V that flash is written at, and lets it go at 2.85 to 2.97 V (datasheet
// table 19); and the bootloader's sector write-protected, so that no program replaces it.

namespace diastole::stm32 {

enum class OptionBytes { as_wanted, written, refused };

/// Writes them if they are not so; `written` ones count from the next reset on. Refused: the supply is too low, or the
/// chip does not take them. Precondition: the clock of PWR is on, the supply's detector too.
OptionBytes secure_option_bytes();

}  // namespace diastole::stm32
