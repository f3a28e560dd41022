#pragma once
// Functions of a 32-bit ELF program by address and by name: where in the firmware something happened.
//
//   ElfSymbols symbols("build/firmware/bin/diastole-stm32f405.elf");
//   symbols.name_at(0x0802'1234)   // "diastole::firmware::StepEngine<...>::on_match()"

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace diastole {

class ElfSymbols {
 public:
  /// Throws InputError: file missing or cut off, no 32-bit ARM ELF, or one without symbols.
  explicit ElfSymbols(const std::string& file);

  /// The function that the address lies in, demangled; nothing outside of all of them.
  [[nodiscard]] std::optional<std::string> name_at(uint32_t address) const;
  /// Of the function called so in the file, without the bit that says Thumb.
  [[nodiscard]] std::optional<uint32_t> address_of(const std::string& name) const;

 private:
  struct Function {
    uint32_t bytes = 0;
    std::string name;
  };
  std::map<uint32_t, Function> functions_;  ///< by their first address
};

}  // namespace diastole
