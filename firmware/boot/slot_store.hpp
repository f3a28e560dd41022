#pragma once
// The two slots and the records as the bootloader sees them, and what it asks of the flash that holds them.

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/boot/boot_decision.hpp"
#include "protocol/signing/ed25519.hpp"
#include "protocol/wire/image_signature.hpp"

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
  /// The public key of who may sign images; all 0xFF: anybody's image is taken.
  { fixed.signing_key() } -> std::same_as<std::span<const std::uint8_t, 32>>;
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

/// The header with its signature.
inline wire::SignedHeader signed_header_in(std::span<const std::uint8_t> slot) {
  return slot.first<wire::kSignedHeaderBytes>();
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
  facts.verified = wire::digest_of(bytes.first<wire::kImageHeaderBytes>(), code) == header->sha256;
  return facts;
}

inline bool is_erased(std::span<const std::uint8_t> bytes) {
  std::uint8_t all = 0xFF;  // std::all_of is thrice as long in the bootloader
  for (const std::uint8_t byte : bytes)
    all &= byte;
  return all == 0xFF;
}

/// Whether the board takes an image with this header from who signed it, whatever its code holds; 14 million cycles.
template <SlotStore S>
wire::UpdateOutcome check_signature(const S& store, wire::SignedHeader header, std::uint32_t counter) {
  if (is_erased(store.signing_key())) return wire::UpdateOutcome::done;
  if (!wire::has_signature_block(header) || is_erased(wire::signature_part(header)))
    return wire::UpdateOutcome::not_signed;
  if (!signing::signature_holds(store.signing_key(), wire::signed_part(header), wire::signature_part(header)))
    return wire::UpdateOutcome::wrong_signature;
  return wire::counter_of(header) < counter ? wire::UpdateOutcome::rolled_back : wire::UpdateOutcome::done;
}

/// Judges by signature only what would be started or kept, so that a start costs one check.
template <SlotStore S>
BootDecision decide(const S& store) {
  std::array<SlotFacts, 2> facts{inspect(store, wire::ImageSlot::a), inspect(store, wire::ImageSlot::b)};
  const std::uint32_t counter = recorded_counter(store.records());
  std::array<bool, 2> judged{};
  for (;;) {
    const BootDecision decision = decide(store.records(), facts);
    bool changed = false;
    for (const wire::ImageSlot slot : {decision.start, decision.keep}) {
      const auto index = static_cast<std::size_t>(slot);
      if (slot == wire::ImageSlot::none || judged[index]) continue;
      judged[index] = true;
      if (check_signature(store, signed_header_in(store.slot(slot)), counter) == wire::UpdateOutcome::done)
        continue;
      facts[index].verified = false;
      facts[index].refused = changed = true;
    }
    if (!changed) return decision;
  }
}

/// Below this nothing is taken: what is recorded, and the counter of the image that would be kept, whatever is recorded of it.
/// So it outlives the moment in which the records are erased.
template <SlotStore S>
std::uint32_t rollback_counter(const S& store, const BootDecision& decision) {
  const std::uint32_t recorded = recorded_counter(store.records());
  if (decision.keep == wire::ImageSlot::none || is_erased(store.signing_key())) return recorded;
  return std::max(recorded, wire::counter_of(signed_header_in(store.slot(decision.keep))));
}

/// Appends a record; false if there is no room or the flash did not take it.
template <SlotStore S>
bool append(S& store, const BootRecord& record) {
  const std::size_t offset = next_record_offset(store.records());
  if (offset + kRecordBytes > store.records().size()) return false;
  return store.write_record(offset, encode(record));
}

/// At a start: a confirmed image's rollback counter is the board's from now on.
template <SlotStore S>
void record_counter(S& store, const BootDecision& decision) {
  const wire::ImageState state = decision.state[static_cast<std::size_t>(decision.start)];
  if (state != wire::ImageState::confirmed || !store.supply_sound()) return;
  const std::uint32_t counter = rollback_counter(store, decision);
  if (counter > recorded_counter(store.records()))
    (void)append(store, {BootEvent::raised, decision.start, tag_of_counter(counter)});
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

}  // namespace diastole::boot
