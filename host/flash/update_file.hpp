#pragma once
// Reading the file that `diastole flash` takes (layout: protocol/wire/update_file.hpp).

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/wire/image_signature.hpp"

namespace diastole {

/// The application linked for one slot.
struct SlotImage {
  wire::ImageHeader header;
  wire::ImageSignature signature;
  std::vector<uint8_t> code;
};

struct UpdateFile {
  std::string file;
  wire::FirmwareVersion version;
  uint16_t board_id = 0;
  uint64_t build_id = 0;
  std::vector<SlotImage> images;
};

/// Throws InputError, naming place and remedy, unless every checksum of the file holds.
UpdateFile read_update_file(const std::string& file);
/// The same of bytes that came from `file`.
UpdateFile parse_update_file(const std::string& file, const std::vector<uint8_t>& bytes);

/// Signs every image of the file in place, with the key in the file `key_file`; `counter` replaces the rollback counter that
/// was built in. Throws InputError: no such file or key, or the file cannot be written.
UpdateFile sign_update_file(const std::string& file, const std::string& key_file,
                            std::optional<uint32_t> counter);

/// "1.2.3"
std::string in_words(wire::FirmwareVersion version);

}  // namespace diastole
