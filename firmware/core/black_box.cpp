#include "firmware/core/black_box.hpp"

#include <algorithm>
#include <span>

#include "protocol/wire/crc32.hpp"
#include "protocol/wire/field_codec.hpp"

namespace diastole::firmware {

namespace {

constexpr std::size_t kBodyBytes = 20;

std::array<std::uint8_t, 4> crc_of(std::span<const std::uint8_t> body) {
  const std::uint32_t crc = wire::crc32(body);
  std::array<std::uint8_t, 4> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::uint8_t>(crc >> (8 * i));
  return bytes;
}

}  // namespace

wire::BlackBoxEntry BlackBox::read(std::size_t slot) const {
  const std::span<const std::uint8_t> bytes(memory_[slot]);
  const auto body = bytes.first(kBodyBytes);
  wire::BlackBoxEntry entry;
  wire::FieldReader reader(body);
  wire::BlackBoxEntry::layout(entry, reader);
  const bool sound = std::ranges::equal(crc_of(body), bytes.last(4)) &&
                     reader.fault().problem == wire::DecodeProblem::none && entry.number % kEntries == slot;
  return sound ? entry : wire::BlackBoxEntry{};
}

void BlackBox::begin(wire::ResetCause cause, std::uint32_t boot_id, Ticks now) {
  if (cause == wire::ResetCause::power_on)
    for (Slot& slot : memory_)
      slot.fill(0);
  for (std::size_t slot = 0; slot < kEntries; ++slot) {
    const wire::BlackBoxEntry entry = read(slot);
    if (entry.number <= newest_) continue;
    newest_ = entry.number;
    boot_ = entry.boot;
  }
  ++boot_;
  note(wire::Noted::started, static_cast<std::uint8_t>(cause), static_cast<std::int32_t>(boot_id), now);
}

void BlackBox::note(wire::Noted kind, std::uint8_t detail, std::int32_t argument, Ticks now) {
  if (kind == last_.kind && detail == last_.detail && argument == last_.argument) return;
  last_ = {newest_ + 1, boot_, kind, detail, on_wire(now), argument};
  Slot slot{};
  wire::FieldWriter writer(slot);
  wire::BlackBoxEntry::layout(last_, writer);
  std::ranges::copy(crc_of(std::span(slot).first(kBodyBytes)), slot.begin() + kBodyBytes);
  memory_[last_.number % kEntries] = slot;
  newest_ = last_.number;
}

void BlackBox::note_crash(const CrashRecord& crash, Ticks now) {
  for (std::size_t i = 0; i < crash.values.size(); ++i)
    note(wire::Noted::crash, static_cast<std::uint8_t>(i), static_cast<std::int32_t>(crash.values[i]), now);
}

wire::BlackBoxEntry BlackBox::first_from(std::uint32_t from) const {
  const std::uint32_t oldest = newest_ >= kEntries ? newest_ - kEntries + 1 : 1;
  for (std::uint32_t number = std::max(from, oldest); number <= newest_; ++number) {
    const wire::BlackBoxEntry entry = read(number % kEntries);
    if (entry.number == number) return entry;
  }
  return {};
}

}  // namespace diastole::firmware
