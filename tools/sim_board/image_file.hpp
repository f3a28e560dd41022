#pragma once
// Program images: a plain binary for one address, or an ELF file that knows its own.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace diastole {

struct ImageSegment {
  uint32_t address = 0;
  std::vector<uint8_t> bytes;
};

struct Image {
  std::string file;
  std::vector<ImageSegment> segments;
  uint32_t flash_bytes = 0;                  ///< what the segments occupy
  std::optional<uint32_t> static_ram_bytes;  ///< .data and .bss with their like; an ELF file says
};

/// Reads FILE or FILE@ADDRESS (hexadecimal with 0x, or decimal). Without an address a binary goes to the
/// start of flash, and an ELF file where it says (then an address is refused). Throws InputError: file
/// missing, empty, or not a 32-bit little-endian ARM ELF; address unreadable.
Image read_image(const std::string& argument);

}  // namespace diastole
