#pragma once
// The two slots and the records as the bootloader sees them, and what it asks of the flash that holds them.

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/boot/boot_decision.hpp"

namespace diastole::boot {

/// Flash with two slots and a sector for records. Writing turns ones into zeros, erasing all into ones;
/// false: the flash did not take it. Offsets and sizes are multiples of 4.
template <class S>
concept SlotStore = requires(S& store, const S& fixed, wire::ImageSlot slot, std::size_t offset,
                             std::span<const std::uint8_t> bytes) {
  { fixed.board_id() } -> std::same_as<std::uint16_t>;
  { fixed.slot_address(slot) } -> std::same_as<std::uint32_t>;
  { fixed.slot(slot) } -> std::same_as<std::span<const std::uint8_t>>;
  { fixed.records() } -> std::same_as<std::span<const std::uint8_t>>;
  /// Whether the supply is high enough to erase and write.
  { fixed.supply_sound() } -> std::same_as<bool>;
  { store.erase_slot(slot) } -> std::same_as<bool>;
  { store.erase_records() } -> std::same_as<bool>;
  { store.write_slot(slot, offset, bytes) } -> std::same_as<bool>;
  { store.write_record(offset, bytes) } -> std::same_as<bool>;
};

/// The header in front of a slot's code, if there is a whole one.
inline std::optional<wire::ImageHeader> header_in(std::span<const std::uint8_t> slot) {
  return wire::decode_image_header(slot.first<wire::kImageHeaderBytes>());
}

/// What speaks against an image in this slot, whatever its code holds.
inline wire::UpdateOutcome fits(const wire::ImageHeader& header, std::uint16_t board_id,
                                std::uint32_t address, std::size_t slot_bytes) {
  if (header.board_id != board_id) return wire::UpdateOutcome::wrong_board;
  if (header.link_address != address) return wire::UpdateOutcome::wrong_slot;
  if (header.code_bytes > slot_bytes - wire::kImageHeaderArea) return wire::UpdateOutcome::too_long;
  if (header.code_bytes == 0 || header.code_bytes % 4 != 0) return wire::UpdateOutcome::bad_header;
  return wire::UpdateOutcome::done;
}

/// Reads the whole slot and hashes it.
template <SlotStore S>
SlotFacts inspect(const S& store, wire::ImageSlot slot) {
  const std::span<const std::uint8_t> bytes = store.slot(slot);
  const auto header = header_in(bytes);
  if (!header) return {};
  SlotFacts facts{true, false, tag_of(*header)};
  if (fits(*header, store.board_id(), store.slot_address(slot), bytes.size()) != wire::UpdateOutcome::done)
    return facts;
  const auto code = bytes.subspan(wire::kImageHeaderArea, header->code_bytes);
  facts.verified = wire::digest_of(*header, code) == header->sha256;
  return facts;
}

template <SlotStore S>
BootDecision decide(const S& store) {
  return decide(store.records(), {inspect(store, wire::ImageSlot::a), inspect(store, wire::ImageSlot::b)});
}

/// Appends a record; false if there is no room or the flash did not take it.
template <SlotStore S>
bool append(S& store, const BootRecord& record) {
  const std::size_t offset = next_record_offset(store.records());
  if (offset + kRecordBytes > store.records().size()) return false;
  return store.write_record(offset, encode(record));
}

/// Bytes of code that an interrupted update surely left in a slot: code is written in order, so everything
/// before the last word that is not erased; that word itself may be half written.
inline std::uint32_t held_code(std::span<const std::uint8_t> slot, std::uint32_t code_bytes) {
  const auto code = slot.subspan(wire::kImageHeaderArea, code_bytes);
  std::size_t end = code.size();
  while (end > 0 && code[end - 1] == 0xFF)
    --end;
  return end == 0 ? 0 : static_cast<std::uint32_t>((end - 1) / 4 * 4);
}

inline bool is_erased(std::span<const std::uint8_t> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0xFF; });
}

}  // namespace diastole::boot
