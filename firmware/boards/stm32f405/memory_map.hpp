#pragma once
// Who owns which part of the STM32F405's memory. stm32f405.ld repeats these numbers for the linker.
//
//   sector  address      size
//     0     0x0800'0000   16 KB  bootloader; its last 32 bytes are the public key that images are signed with
//     1     0x0800'4000   16 KB  the bootloader's records: which slot is on trial, which is confirmed
//     2, 3  0x0800'8000   2 x 16 KB  settings
//     4     0x0801'0000   64 KB  free
//     5     0x0802'0000  128 KB  slot A: image header (512 bytes), then the application
//     6     0x0804'0000  128 KB  slot B
//
//   RAM     0x2000'0000  124 KB  data and stack; the first byte shows the latched fault
//           0x2001'F000    4 KB  retained: no start-up code writes here, so it outlives a reset, though not
//                                a loss of power; 64 bytes of hand-over (hand_over.hpp), the last word of them the
//                                bootloader's own, then section .retained for the application

#include <array>
#include <cstddef>
#include <cstdint>

namespace diastole::stm32 {

struct FlashSector {
  std::uint32_t number = 0;
  std::uint32_t address = 0;
  std::uint32_t bytes = 0;
};

inline constexpr FlashSector kBootloaderSector{0, 0x0800'0000, 0x4000};
/// Ed25519; all 0xFF if the laboratory wants none. Written with the bootloader, whose sector is write-protected then.
inline constexpr std::uint32_t kSigningKeyAddress = 0x0800'3FE0;
inline constexpr FlashSector kRecordSector{1, 0x0800'4000, 0x4000};
inline constexpr std::array<FlashSector, 2> kSettingsSectors{
    {{2, 0x0800'8000, 0x4000}, {3, 0x0800'C000, 0x4000}}};
inline constexpr std::array<FlashSector, 2> kSlotSectors{
    {{5, 0x0802'0000, 0x2'0000}, {6, 0x0804'0000, 0x2'0000}}};

inline constexpr std::uint32_t kRetainedAddress = 0x2001'F000;
inline constexpr std::size_t kRetainedBytes = 0x1000;
/// At the start of the retained memory, between bootloader and application.
inline constexpr std::size_t kHandOverBytes = 64;

}  // namespace diastole::stm32
