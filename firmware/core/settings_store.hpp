#pragma once
// Settings that outlive a power cut: append-only records in two flash sectors that are used in turn.
//
//   sector 0  | record 5 | record 6 | torn | record 7 |  blank …            current: 7
//   sector 1  | record 3 | record 4 | …             older; erased when sector 0 is full
//
//   slot (kSlotBytes)   offset size
//                            0    4 kMagic; kFirstMagic: without the settings that came later, which then are initial
//                            4    4 number       counts up; the highest valid record is in force
//                            8    2 body_bytes
//                           10    n body         wire::MachineSettings
//                            .    . FF
//             kSlotBytes - 4      4 crc          CRC-32 (crc32.hpp) of all before it
//
// A record goes into the first slot behind which its sector is blank, is read back, and if it is not what was
// written the next slot is taken. Only when the sector of the current record is full is the *other* one erased:
// at every moment after the first record a valid one is there, whatever operation a power cut hits. A sector is
// always erased before its first slot is used, also if it looks blank: an erase that was cut off may leave cells
// that read as erased and are not.
//
// Flash is any type with
//   std::span<const std::uint8_t> sector(std::size_t index) const;   // index 0 or 1
//   bool erase(std::size_t index);
//   bool program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes);  // multiples of 4

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/machine_settings.hpp"

namespace diastole::firmware {

struct SettingsRecord {
  static constexpr std::size_t kSlotBytes = 128;
  static constexpr std::uint32_t kMagic = 0x3253'5344;       // "DSS2"
  static constexpr std::uint32_t kFirstMagic = 0x5445'5344;  // "DSET"
  static constexpr int kSettings = 256, kFirstSettings = 8;
  using Slot = std::array<std::uint8_t, kSlotBytes>;

  std::uint32_t number = 0;
  wire::MachineSettings settings;
};

SettingsRecord::Slot encode_record(const SettingsRecord& record);
/// Nothing unless magic, CRC and every field's range are right. Precondition: slot.size() == kSlotBytes.
std::optional<SettingsRecord> decode_record(std::span<const std::uint8_t> slot);

template <class Flash>
class SettingsStore {
 public:
  /// Looks for the current record.
  explicit SettingsStore(Flash& flash) : flash_(flash) {
    for (std::size_t sector = 0; sector < 2; ++sector)
      for (std::size_t slot = 0; slot < slots(); ++slot)
        consider(sector, slot);
  }

  /// Number of the record in force; 0 if there is none, and then settings() are the initial ones.
  [[nodiscard]] std::uint32_t records_written() const { return current_.number; }
  [[nodiscard]] const wire::MachineSettings& settings() const { return current_.settings; }

  /// Makes `settings` the ones in force; false if the flash did not take them, and then the old ones stay.
  /// Takes up to a second when a sector has to be erased. Precondition: they are in range.
  bool write(const wire::MachineSettings& settings) {
    const SettingsRecord next{current_.number + 1, settings};
    const SettingsRecord::Slot bytes = encode_record(next);
    std::size_t sector = current_.number > 0 ? sector_ : 1;
    std::size_t slot = current_.number > 0 ? first_blank(sector_) : slots();
    for (std::size_t tries = 0; tries < slots() + 1; ++tries, ++slot) {
      if (slot >= slots()) {
        if (sector != sector_ && current_.number > 0) return false;  // the fresh sector is no good either
        sector = 1 - sector;
        if (!flash_.erase(sector)) return false;
        slot = 0;
      }
      if (!put(sector, slot, bytes)) continue;
      current_ = next;
      sector_ = sector;
      return true;
    }
    return false;
  }

 private:
  [[nodiscard]] std::size_t slots() const { return flash_.sector(0).size() / SettingsRecord::kSlotBytes; }
  [[nodiscard]] std::span<const std::uint8_t> slot_bytes(std::size_t sector, std::size_t slot) const {
    return flash_.sector(sector).subspan(slot * SettingsRecord::kSlotBytes, SettingsRecord::kSlotBytes);
  }
  void consider(std::size_t sector, std::size_t slot) {
    const auto record = decode_record(slot_bytes(sector, slot));
    if (!record || record->number <= current_.number) return;
    current_ = *record;
    sector_ = sector;
  }
  /// The first slot behind which everything is erased.
  [[nodiscard]] std::size_t first_blank(std::size_t sector) const {
    std::size_t slot = slots();
    while (slot > 0 &&
           std::ranges::all_of(slot_bytes(sector, slot - 1), [](auto byte) { return byte == 0xFF; }))
      --slot;
    return slot;
  }
  bool put(std::size_t sector, std::size_t slot, const SettingsRecord::Slot& bytes) {
    return flash_.program(sector, slot * SettingsRecord::kSlotBytes, bytes) &&
           std::ranges::equal(slot_bytes(sector, slot), bytes);
  }

  Flash& flash_;
  SettingsRecord current_;
  std::size_t sector_ = 0;
};

}  // namespace diastole::firmware
