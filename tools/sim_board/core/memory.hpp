#pragma once
// The board's memories as seen by program and model alike.

#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace diastole::board_model {

inline constexpr uint32_t flash_base = 0x0800'0000, flash_bytes = 0x10'0000;
inline constexpr uint32_t sram_base = 0x2000'0000, sram_bytes = 0x2'0000;
inline constexpr uint32_t ccm_base = 0x1000'0000, ccm_bytes = 0x1'0000;
inline constexpr uint32_t backup_base = 0x4002'4000, backup_bytes = 0x1000;
inline constexpr uint32_t system_base = 0x1fff'7000, system_bytes = 0x1000;

/// RAM holds this pattern at power-up, so that what a stack has touched can be seen afterwards.
inline constexpr uint8_t untouched = 0xa5;

class Memory {
 public:
  Memory();

  /// Power-up: RAM forgets, flash keeps.
  void forget_ram();

  /// `length` bytes at `address`, or empty when they do not all lie in one memory.
  [[nodiscard]] std::span<uint8_t> at(uint32_t address, uint32_t length);

  [[nodiscard]] std::optional<uint32_t> word(uint32_t address) {
    const auto bytes = at(address, 4);
    if (bytes.empty()) return std::nullopt;
    uint32_t value = 0;
    std::memcpy(&value, bytes.data(), 4);
    return value;
  }
  bool set_word(uint32_t address, uint32_t value) {
    const auto bytes = at(address, 4);
    if (bytes.empty()) return false;
    std::memcpy(bytes.data(), &value, 4);
    return true;
  }

  [[nodiscard]] std::span<uint8_t> flash() { return flash_; }
  [[nodiscard]] std::span<uint8_t> sram() { return sram_; }
  [[nodiscard]] std::span<uint8_t> ccm() { return ccm_; }
  [[nodiscard]] std::span<uint8_t> backup() { return backup_; }
  [[nodiscard]] std::span<uint8_t> system() { return system_; }

 private:
  /// Page-aligned, as the emulator maps them directly.
  struct Pages {
    explicit Pages(std::size_t bytes);
    [[nodiscard]] std::span<uint8_t> bytes() { return {start_, size_}; }

   private:
    std::vector<uint8_t> storage_;
    uint8_t* start_;
    std::size_t size_;
  };

  Pages flash_pages_, sram_pages_, ccm_pages_, backup_pages_, system_pages_;
  std::span<uint8_t> flash_, sram_, ccm_, backup_, system_;
};

}  // namespace diastole::board_model
