#pragma once
// What has happened to the images, written one behind the other into a flash sector of its own and never
// changed: the bootloader's memory over resets and power cuts.
//
//   offset size field
//        0    2 magic     "BR"
//        2    1 event     BootEvent
//        3    1 slot      wire::ImageSlot, a or b
//        4    8 tag       first bytes of the image's SHA-256: an event concerns this image only; zeros for the
//                         events of a slot; for `raised` the counter, 32 bits, and zeros
//       12    4 crc       CRC-32 of bytes 0 ... 11
//
//   Example: slot A, whose SHA-256 begins 01 02 03 04 05 06 07 08, is confirmed
//     42 52 03 00 01 02 03 04 05 06 07 08 4A 67 80 36
//
// A record that a power cut left half written fails its CRC and counts as nothing; the next one goes behind
// it. The sector's last written cell decides where "behind" is, so order is age even in a sector whose erase
// was cut short.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/image_header.hpp"
#include "protocol/wire/update.hpp"

namespace diastole::boot {

enum class BootEvent : std::uint8_t {
  none = 0,
  installed = 1,  ///< verified and to be tried at the next start
  tried = 2,      ///< about to be started on trial
  confirmed = 3,  ///< a host has seen it work
  // Of the slot, whatever it holds:
  erase_begun = 4,  ///< not to be trusted until `erased`, however its cells read
  erased = 5,
  // Of the board:
  raised = 6,  ///< the rollback counter is this (image_signature.hpp); it never falls
};
inline constexpr BootEvent kLastBootEvent = BootEvent::raised;

constexpr bool of_slot(BootEvent event) {
  return event == BootEvent::erase_begun || event == BootEvent::erased;
}

using ImageTag = std::array<std::uint8_t, 8>;

constexpr ImageTag tag_of(const wire::ImageHeader& header) {
  ImageTag tag{};
  std::copy_n(header.sha256.begin(), tag.size(), tag.begin());
  return tag;
}

constexpr ImageTag tag_of_counter(std::uint32_t counter) {
  ImageTag tag{};
  wire::detail::put_little(std::span(tag), counter);
  return tag;
}

struct BootRecord {
  BootEvent event = BootEvent::none;
  wire::ImageSlot slot = wire::ImageSlot::a;
  ImageTag tag{};
  bool operator==(const BootRecord&) const = default;
};

inline constexpr std::size_t kRecordBytes = 16;
using RecordBytes = std::array<std::uint8_t, kRecordBytes>;

constexpr RecordBytes encode(const BootRecord& record) {
  RecordBytes bytes{'B', 'R', static_cast<std::uint8_t>(record.event),
                    static_cast<std::uint8_t>(record.slot)};
  std::copy(record.tag.begin(), record.tag.end(), bytes.begin() + 4);
  wire::detail::put_little(std::span(bytes).subspan(12), wire::crc32(std::span(bytes).first(12)));
  return bytes;
}

/// Nothing if the cell is empty or torn.
constexpr std::optional<BootRecord> decode_record(std::span<const std::uint8_t, kRecordBytes> bytes) {
  if (bytes[0] != 'B' || bytes[1] != 'R' || bytes[2] < 1 ||
      bytes[2] > static_cast<std::uint8_t>(kLastBootEvent) || bytes[3] > 1 ||
      wire::detail::get_little<std::uint32_t>(bytes.subspan(12)) != wire::crc32(bytes.first(12)))
    return {};
  BootRecord record{static_cast<BootEvent>(bytes[2]), static_cast<wire::ImageSlot>(bytes[3]), {}};
  std::copy_n(bytes.begin() + 4, record.tag.size(), record.tag.begin());
  return record;
}

/// Offset of the cell for the next record; the sector's size when there is none left.
constexpr std::size_t next_record_offset(std::span<const std::uint8_t> sector) {
  std::size_t end = sector.size();
  while (end > 0 && sector[end - 1] == 0xFF)
    --end;
  return (end + kRecordBytes - 1) / kRecordBytes * kRecordBytes;
}

constexpr std::size_t records_left(std::span<const std::uint8_t> sector) {
  return (sector.size() - next_record_offset(sector)) / kRecordBytes;
}

/// Calls `visit` with each whole record, oldest first.
template <class Visitor>
constexpr void for_each_record(std::span<const std::uint8_t> sector, Visitor&& visit) {
  for (; sector.size() >= kRecordBytes; sector = sector.subspan(kRecordBytes))
    if (const auto record = decode_record(sector.first<kRecordBytes>())) visit(*record);
}

/// The last event of the slot itself, whatever was in it; none if there is none.
constexpr BootEvent last_of_slot(std::span<const std::uint8_t> sector, wire::ImageSlot slot) {
  BootEvent last = BootEvent::none;
  for_each_record(sector, [&](const BootRecord& record) {
    if (record.slot == slot && record.event != BootEvent::raised) last = record.event;
  });
  return of_slot(last) ? last : BootEvent::none;
}

/// The highest rollback counter that is recorded; 0 if none is.
constexpr std::uint32_t recorded_counter(std::span<const std::uint8_t> sector) {
  std::uint32_t highest = 0;
  for_each_record(sector, [&](const BootRecord& record) {
    if (record.event == BootEvent::raised)
      highest = std::max(highest, wire::detail::get_little<std::uint32_t>(record.tag));
  });
  return highest;
}

/// Whether an erase of the slot was begun and not ended.
constexpr bool erase_interrupted(std::span<const std::uint8_t> sector, wire::ImageSlot slot) {
  return last_of_slot(sector, slot) == BootEvent::erase_begun;
}

}  // namespace diastole::boot
