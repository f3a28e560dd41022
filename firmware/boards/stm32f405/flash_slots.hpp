#pragma once
// The slots and records of firmware/boot in this chip's flash; for bootloader and application.

#include "firmware/boards/stm32f405/boot_identity.hpp"
#include "firmware/boards/stm32f405/flash.hpp"
#include "firmware/boards/stm32f405/supply.hpp"
#include "firmware/boot/slot_store.hpp"

namespace diastole::stm32 {

inline std::span<const std::uint8_t> bytes_of(const FlashSector& sector) {
  return {reinterpret_cast<const std::uint8_t*>(sector.address), sector.bytes};
}

class FlashSlots {
 public:
  [[nodiscard]] std::uint16_t board_id() const { return kBoardId; }
  [[nodiscard]] std::uint32_t slot_address(wire::ImageSlot slot) const { return sector_of(slot).address; }
  [[nodiscard]] std::span<const std::uint8_t> slot(wire::ImageSlot slot) const {
    return bytes_of(sector_of(slot));
  }
  [[nodiscard]] std::span<const std::uint8_t> records() const { return bytes_of(kRecordSector); }
  [[nodiscard]] std::span<const std::uint8_t, 32> signing_key() const {
    return bytes_of(kBootloaderSector).subspan<kSigningKeyAddress - kBootloaderSector.address, 32>();
  }
  [[nodiscard]] bool supply_sound() const { return supply_suffices(); }
  bool erase_slot(wire::ImageSlot slot) { return erase(sector_of(slot)) == FlashFault::none; }
  bool erase_records() { return erase(kRecordSector) == FlashFault::none; }
  bool write_slot(wire::ImageSlot slot, std::size_t offset, std::span<const std::uint8_t> bytes) {
    return write(sector_of(slot).address + offset, bytes);
  }
  bool write_record(std::size_t offset, std::span<const std::uint8_t> bytes) {
    return write(kRecordSector.address + offset, bytes);
  }

 private:
  static const FlashSector& sector_of(wire::ImageSlot slot) {
    return kSlotSectors[slot == wire::ImageSlot::b ? 1 : 0];
  }
  static bool write(std::uint32_t address, std::span<const std::uint8_t> bytes);
};

}  // namespace diastole::stm32
