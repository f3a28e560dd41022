#include "tools/sim_board/image_file.hpp"

#include <elf.h>
#include <fmt/format.h>

#include <cstring>
#include <span>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr uint32_t start_of_flash = 0x0800'0000;
constexpr uint32_t ram_first = 0x1000'0000, ram_last = 0x2fff'ffff;

[[noreturn]] void refuse(const std::string& file, std::string problem, std::string remedy) {
  throw InputError({file, "", std::move(problem), std::move(remedy)});
}

std::vector<uint8_t> read_bytes(const std::string& file) {
  const std::string remedy =
      "Give an image, such as build/firmware/bin/diastole-stm32f405.bin (cmake --preset firmware builds it).";
  const std::string bytes = read_bounded_file(file, most_table_bytes, remedy);
  if (bytes.empty()) refuse(file, "is empty", remedy);
  return {bytes.begin(), bytes.end()};
}

/// A structure at `offset`; refuses files that end before it does.
template <class Structure>
Structure structure_at(const std::string& file, std::span<const uint8_t> bytes, std::size_t offset) {
  Structure found{};
  if (offset > bytes.size() || bytes.size() - offset < sizeof found) {
    refuse(file, "the ELF file is cut off", "Build the image anew.");
  }
  std::memcpy(&found, bytes.data() + offset, sizeof found);
  return found;
}

void add_segments(Image& image, std::span<const uint8_t> bytes, const Elf32_Ehdr& header) {
  for (uint32_t i = 0; i < header.e_phnum; ++i) {
    const auto segment =
        structure_at<Elf32_Phdr>(image.file, bytes, header.e_phoff + std::size_t{i} * header.e_phentsize);
    if (segment.p_type != PT_LOAD || segment.p_filesz == 0) continue;
    if (std::size_t{segment.p_offset} + segment.p_filesz > bytes.size()) {
      refuse(image.file, "the ELF file is cut off", "Build the image anew.");
    }
    const auto content = bytes.subspan(segment.p_offset, segment.p_filesz);
    image.segments.push_back({segment.p_paddr, {content.begin(), content.end()}});
    image.flash_bytes += segment.p_filesz;
  }
}

uint32_t static_ram(const std::string& file, std::span<const uint8_t> bytes, const Elf32_Ehdr& header) {
  uint32_t sum = 0;
  for (uint32_t i = 0; i < header.e_shnum; ++i) {
    const auto section =
        structure_at<Elf32_Shdr>(file, bytes, header.e_shoff + std::size_t{i} * header.e_shentsize);
    const bool in_ram = section.sh_addr >= ram_first && section.sh_addr <= ram_last;
    if (in_ram && (section.sh_flags & SHF_ALLOC) != 0) sum += section.sh_size;
  }
  return sum;
}

Image from_elf(const std::string& file, std::span<const uint8_t> bytes) {
  const auto header = structure_at<Elf32_Ehdr>(file, bytes, 0);
  if (header.e_ident[EI_CLASS] != ELFCLASS32 || header.e_ident[EI_DATA] != ELFDATA2LSB ||
      header.e_machine != EM_ARM) {
    refuse(file, "is an ELF file, but not for a 32-bit ARM",
           "Give the image that the firmware preset builds.");
  }
  Image image{file, {}, 0, {}};
  add_segments(image, bytes, header);
  image.static_ram_bytes = static_ram(file, bytes, header);
  if (image.segments.empty()) refuse(file, "holds no program", "Give a linked image, not an object file.");
  return image;
}

std::optional<uint32_t> parse_address(const std::string& text) {
  std::size_t used = 0;
  try {
    const unsigned long value = std::stoul(text, &used, 0);
    if (used == text.size() && value <= 0xffff'ffff) return static_cast<uint32_t>(value);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

Image read_image(const std::string& argument) {
  const auto at = argument.rfind('@');
  const std::string file = argument.substr(0, at);
  std::optional<uint32_t> address;
  if (at != std::string::npos) {
    address = parse_address(argument.substr(at + 1));
    if (!address)
      refuse(file, fmt::format("'{}' is no address", argument.substr(at + 1)), "Write FILE@0x08010000.");
  }
  std::vector<uint8_t> bytes = read_bytes(file);
  if (bytes.size() > SELFMAG && std::memcmp(bytes.data(), ELFMAG, SELFMAG) == 0) {
    if (address) refuse(file, "an ELF file tells its own addresses", "Leave out the @ADDRESS.");
    return from_elf(file, bytes);
  }
  const auto size = static_cast<uint32_t>(bytes.size());
  return {file, {{address.value_or(start_of_flash), std::move(bytes)}}, size, {}};
}

}  // namespace diastole
