#pragma once
// Update files as the packer makes them, for any board, version and size.

#include <random>
#include <vector>

#include "protocol/wire/image_signature.hpp"
#include "protocol/wire/update_file.hpp"

namespace diastole::flash_test {

struct FileRecipe {
  uint16_t board_id = 2;
  wire::FirmwareVersion version;
  size_t code_bytes = 64;
  wire::ImageSignature signature = {};
};

inline std::vector<uint8_t> make_update_file(const FileRecipe& recipe) {
  std::vector<uint8_t> file(wire::kUpdateFileMagic.begin(), wire::kUpdateFileMagic.end());
  const auto add_number = [&file](uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i)
      file.push_back(static_cast<uint8_t>(value >> (8 * i)));
  };
  add_number(wire::kUpdateFileVersion, 2);
  add_number(2, 2);
  add_number(wire::kUpdateFileHeadBytes + 2 * (wire::kSignedHeaderBytes + recipe.code_bytes) + 32, 4);
  std::mt19937 random(17);
  for (const uint32_t address : {0x0802'0000U, 0x0804'0000U}) {
    std::vector<uint8_t> code(recipe.code_bytes);
    for (auto& byte : code)
      byte = static_cast<uint8_t>(random());
    wire::ImageHeader header;
    header.board_id = recipe.board_id;
    header.version = recipe.version;
    header.build_id = 0xB17D;
    header.link_address = address;
    header.code_bytes = static_cast<uint32_t>(code.size());
    header.sha256 = wire::digest_of(header, code);
    const auto encoded = wire::encode(header);
    file.insert(file.end(), encoded.begin(), encoded.end());
    const auto signature = wire::encode(recipe.signature);
    file.insert(file.end(), signature.begin(), signature.end());
    file.insert(file.end(), code.begin(), code.end());
  }
  const auto digest = wire::sha256(file);
  file.insert(file.end(), digest.begin(), digest.end());
  return file;
}

}  // namespace diastole::flash_test
