#pragma once
// The board's memories as seen by program and model alike.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
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
  Memory()
      : flash_pages_(flash_bytes),
        sram_pages_(sram_bytes),
        ccm_pages_(ccm_bytes),
        backup_pages_(backup_bytes),
        system_pages_(system_bytes),
        flash_(flash_pages_.bytes()),
        sram_(sram_pages_.bytes()),
        ccm_(ccm_pages_.bytes()),
        backup_(backup_pages_.bytes()),
        system_(system_pages_.bytes()) {
    std::ranges::fill(flash_, uint8_t{0xff});
    std::ranges::fill(system_, uint8_t{0xff});
    std::ranges::copy(unique_id, system_.begin() + unique_id_offset);
    system_[flash_size_offset] = flash_bytes / 1024 & 0xff;
    system_[flash_size_offset + 1] = flash_bytes / 1024 >> 8;
    forget_ram();
  }

  /// Power-up: RAM forgets, flash keeps.
  void forget_ram() {
    for (const auto ram : {sram_, ccm_, backup_})
      std::ranges::fill(ram, untouched);
  }

  /// `length` bytes at `address`, or empty when they do not all lie in one memory.
  [[nodiscard]] std::span<uint8_t> at(uint32_t address, uint32_t length) {
    const auto inside = [&](uint32_t base, std::span<uint8_t> memory) {
      return address >= base && uint64_t{address} + length <= uint64_t{base} + memory.size();
    };
    if (inside(flash_base, flash_)) return flash_.subspan(address - flash_base, length);
    if (inside(sram_base, sram_)) return sram_.subspan(address - sram_base, length);
    if (inside(ccm_base, ccm_)) return ccm_.subspan(address - ccm_base, length);
    if (inside(backup_base, backup_)) return backup_.subspan(address - backup_base, length);
    if (inside(system_base, system_)) return system_.subspan(address - system_base, length);
    if (inside(0, flash_)) return flash_.subspan(address, length);  // boot alias
    return {};
  }

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
  static constexpr std::size_t page_bytes = 4096;
  static constexpr uint32_t unique_id_offset = 0xa10, flash_size_offset = 0xa22;  // RM0090, 39
  static constexpr std::array<uint8_t, 12> unique_id{0x32, 0x00, 0x2b, 0x00, 0x0d, 0x47,
                                                     0x36, 0x30, 0x31, 0x39, 0x32, 0x36};

  /// Page-aligned, as the emulator maps them directly.
  struct Pages {
    explicit Pages(std::size_t bytes) : storage_(bytes + page_bytes), start_(nullptr), size_(bytes) {
      void* place = storage_.data();
      std::size_t room = storage_.size();
      start_ = static_cast<uint8_t*>(std::align(page_bytes, bytes, place, room));
    }
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
