#pragma once
// What the vendor's description says of the registers that the firmware uses (facts/stm32f405.inc, of the public SVD file),
// and what it says to one access: a judge that shares nothing with the peripherals' models.
//
//   reserved bits are written with the value that they have after reset; what is read only may be written, to no effect
//   no register is read that is write-only, nor one used that the description does not have
//   accesses are as wide as the reference manual asks of each peripheral, and aligned

#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>

namespace diastole::board_model {

struct RegisterFact {
  std::string_view peripheral;
  uint32_t base = 0;
  std::string_view name;
  uint32_t offset = 0, size_bits = 0, reset = 0, readable = 0, writable = 0;

  [[nodiscard]] uint32_t address() const { return base + offset; }
  /// What the description leaves out and RM0090 has.
  [[nodiscard]] uint32_t known() const { return readable | writable; }
};

inline constexpr RegisterFact register_facts[] = {
#define DIASTOLE_REGISTER_FACT(peripheral, base, name, offset, size_bits, reset, readable, writable) \
  {#peripheral, base, #name, offset, size_bits, reset, readable, writable},
#include "tools/sim_board/facts/stm32f405.inc"
};

/// Where the vendor's description is wrong, with the place in RM0090 Rev 19 that has it right.
struct Erratum {
  uint32_t address = 0;
  std::optional<uint32_t> reset;  ///< the right one
  uint32_t also_known = 0;        ///< bits that it lacks
  std::string_view reason;
};
inline constexpr Erratum description_errata[] = {
    {0x4000'7000, 0x4000, 1U << 14, "PWR_CR.VOS, 5.4.1: the F405's one bit, set after reset"},
    {0x4002'3c14, 0x0fff'aaed, 0, "FLASH_OPTCR, 3.9.10: as the option bytes leave the factory"},
    {0x4000'4800, 0xc0, 0, "USART_SR, 30.6.1: TXE and TC are bits 7 and 6"},
    {0x4002'0008, 0x0c00'0000, 0, "GPIOA_OSPEEDR, 8.4.3: the debug pins"},
    {0xe004'2000, 0x1007'6413, 0, "DBGMCU_IDCODE, 38.6.1: 0x413, and the revision of the chip"},
};

class RegisterJudge {
 public:
  RegisterJudge() {
    for (const RegisterFact& fact : register_facts) {
      // Alternate views of one register (CCMR as output and input) are one here.
      const auto [place, fresh] = by_address_.try_emplace(fact.address(), fact);
      if (!fresh) {
        place->second.readable |= fact.readable;
        place->second.writable |= fact.writable;
      }
      bases_.emplace(fact.base, fact.peripheral);
    }
    for (const Erratum& erratum : description_errata) {
      const auto found = by_address_.find(erratum.address);
      if (found == by_address_.end()) continue;
      if (erratum.reset) found->second.reset = *erratum.reset;
      found->second.readable |= erratum.also_known;
      found->second.writable |= erratum.also_known;
    }
  }

  /// What is wrong with an access of `bytes` bytes, in words; nothing of a peripheral that the facts do not have.
  [[nodiscard]] std::optional<std::string> read(uint32_t address, uint32_t bytes) const {
    return judge(address, bytes, [&](const RegisterFact& fact) -> std::optional<std::string> {
      if (fact.readable != 0 || fact.writable == 0) return {};
      return "read of " + named(fact) + ", which can only be written";
    });
  }
  [[nodiscard]] std::optional<std::string> write(uint32_t address, uint32_t value, uint32_t bytes) const {
    return judge(address, bytes, [&](const RegisterFact& fact) -> std::optional<std::string> {
      const uint32_t shift = 8 * (address & 3);
      const uint32_t mask = (bytes >= 4 ? 0xffff'ffffU : (1U << 8 * bytes) - 1) << shift;
      const uint32_t wrong = ((value << shift) ^ fact.reset) & mask & ~fact.known();
      if (wrong == 0) return {};
      char text[80];
      std::snprintf(text, sizeof text, ": 0x%08x changes reserved bits 0x%08x", value, wrong);
      return "write of " + named(fact) + text;
    });
  }
  /// The register at `address`, with what the description has wrong put right; null if it has none.
  [[nodiscard]] const RegisterFact* fact_at(uint32_t address) const {
    const auto found = by_address_.find(address);
    return found == by_address_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] const auto& facts() const { return by_address_; }

 private:
  static std::string named(const RegisterFact& fact) {
    return std::string(fact.peripheral) + "_" + std::string(fact.name);
  }
  /// The narrowest access that the manual allows, RM0090 at the head of each peripheral's register section.
  static uint32_t least_bytes(std::string_view peripheral) {
    if (peripheral.starts_with("GPIO") || peripheral == "RCC" || peripheral == "SYSCFG") return 1;
    if (peripheral.starts_with("TIM") || peripheral.starts_with("USART") || peripheral == "PWR" ||
        peripheral == "IWDG")
      return 2;
    return 4;
  }
  template <class Question>
  std::optional<std::string> judge(uint32_t address, uint32_t bytes, Question&& question) const {
    constexpr uint32_t block = 0x400;
    const auto base = bases_.find(address & ~(block - 1));
    if (base == bases_.end()) return {};
    const RegisterFact* fact = fact_at(address & ~3U);
    if (fact == nullptr) {
      char text[80];
      std::snprintf(text, sizeof text, ": there is no register at 0x%08x", address & ~3U);
      return std::string(base->second) + text;
    }
    if (bytes < least_bytes(fact->peripheral))
      return "access of " + named(*fact) + " with " + std::to_string(8 * bytes) + " bits, too narrow";
    if (address % bytes != 0) return "access across words at " + named(*fact);
    return question(*fact);
  }

  std::unordered_map<uint32_t, RegisterFact> by_address_;
  std::unordered_map<uint32_t, std::string_view> bases_;
};

}  // namespace diastole::board_model
