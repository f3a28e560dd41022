#include "tools/sim_board/core/memory.hpp"

#include <algorithm>
#include <array>
#include <memory>

namespace diastole::board_model {
namespace {

constexpr std::size_t page_bytes = 4096;
constexpr uint32_t unique_id_offset = 0xa10, flash_size_offset = 0xa22;  // RM0090, 39
constexpr std::array<uint8_t, 12> unique_id{0x32, 0x00, 0x2b, 0x00, 0x0d, 0x47,
                                            0x36, 0x30, 0x31, 0x39, 0x32, 0x36};

}  // namespace

Memory::Pages::Pages(std::size_t bytes) : storage_(bytes + page_bytes), start_(nullptr), size_(bytes) {
  void* place = storage_.data();
  std::size_t room = storage_.size();
  start_ = static_cast<uint8_t*>(std::align(page_bytes, bytes, place, room));
}

Memory::Memory()
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

void Memory::forget_ram() {
  for (const auto ram : {sram_, ccm_, backup_})
    std::ranges::fill(ram, untouched);
}

std::span<uint8_t> Memory::at(uint32_t address, uint32_t length) {
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

}  // namespace diastole::board_model
