#include "host/flash/elf_symbols.hpp"

#include <cxxabi.h>
#include <elf.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr const char* its_image = "Give the .elf that was built with the image that the controller runs.";

[[noreturn]] void refuse(const std::string& file, const char* problem) {
  throw InputError({file, "", problem, its_image});
}

template <class Structure>
Structure structure_at(const std::string& file, std::span<const char> bytes, size_t offset) {
  Structure found{};
  if (offset > bytes.size() || bytes.size() - offset < sizeof found) refuse(file, "is cut off");
  std::memcpy(&found, bytes.data() + offset, sizeof found);
  return found;
}

std::string name_from(const std::string& file, std::span<const char> bytes, const Elf32_Shdr& strings,
                      uint32_t at) {
  const size_t first = size_t{strings.sh_offset} + at;
  if (first >= bytes.size()) refuse(file, "is cut off");
  const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(first);
  return {from, std::find(from, bytes.end(), '\0')};
}

std::string demangled(const std::string& name) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> words(
      abi::__cxa_demangle(name.c_str(), nullptr, nullptr, &status), std::free);
  return status == 0 ? words.get() : name;
}

}  // namespace

ElfSymbols::ElfSymbols(const std::string& file) {
  const std::string bytes = read_bounded_file(file, most_table_bytes, its_image);
  if (!bytes.starts_with(ELFMAG)) refuse(file, bytes.empty() ? "is empty" : "is no ELF file");
  const auto header = structure_at<Elf32_Ehdr>(file, bytes, 0);
  if (header.e_ident[EI_CLASS] != ELFCLASS32 || header.e_machine != EM_ARM)
    refuse(file, "is not for a 32-bit ARM");
  const auto section = [&](uint32_t index) {
    return structure_at<Elf32_Shdr>(file, bytes, header.e_shoff + size_t{index} * header.e_shentsize);
  };
  for (uint32_t i = 0; i < header.e_shnum; ++i) {
    const Elf32_Shdr table = section(i);
    if (table.sh_type != SHT_SYMTAB || table.sh_entsize < sizeof(Elf32_Sym)) continue;
    const Elf32_Shdr strings = section(table.sh_link);
    for (uint32_t at = 0; at + table.sh_entsize <= table.sh_size; at += table.sh_entsize) {
      const auto symbol = structure_at<Elf32_Sym>(file, bytes, size_t{table.sh_offset} + at);
      if (ELF32_ST_TYPE(symbol.st_info) != STT_FUNC || symbol.st_size == 0) continue;
      functions_[symbol.st_value & ~1U] = {symbol.st_size, name_from(file, bytes, strings, symbol.st_name)};
    }
  }
  if (functions_.empty()) refuse(file, "has no symbols of functions");
}

std::optional<std::string> ElfSymbols::name_at(uint32_t address) const {
  auto after = functions_.upper_bound(address & ~1U);
  if (after == functions_.begin()) return std::nullopt;
  const auto& [first, function] = *--after;
  if (address - first >= function.bytes) return std::nullopt;
  return demangled(function.name);
}

std::optional<uint32_t> ElfSymbols::address_of(const std::string& name) const {
  const auto found =
      std::ranges::find_if(functions_, [&](const auto& each) { return each.second.name == name; });
  if (found == functions_.end()) return std::nullopt;
  return found->first;
}

}  // namespace diastole
