#pragma once
// An update on slots in memory, as host, bootloader and application carry it out together.

#include <gtest/gtest.h>

#include "firmware/boot/update_session.hpp"
#include "tests/firmware/boot/memory_slots.hpp"

namespace diastole::boot_test {

using boot::append;
using boot::BootEvent;
using boot::decide;
using boot::inspect;
using boot::UpdateSession;
using wire::ImageState;
using wire::UpdateOutcome;

inline const TestImage old_image = make_image(2048, {0, 1, 0}, 1);

/// A board that left the factory: slot A confirmed.
inline MemorySlots factory_new(const TestImage& image = old_image, std::size_t record_bytes = 0x4000) {
  MemorySlots slots(0x2'0000, record_bytes);
  put(slots, ImageSlot::a, image);
  EXPECT_TRUE(append(slots, {BootEvent::confirmed, ImageSlot::a, tag(image, ImageSlot::a)}));
  return slots;
}

inline wire::BeginUpdate begin_of(const wire::ImageHeader& header, bool allow_older = false) {
  wire::BeginUpdate begin;
  begin.allow_older = allow_older ? 1 : 0;
  begin.header_bytes = wire::kImageHeaderBytes;
  const auto encoded = wire::encode(header);
  std::copy(encoded.begin(), encoded.end(), begin.header.begin());
  return begin;
}

/// What a host does, as far as the bootloader sees it.
inline UpdateOutcome install(MemorySlots& slots, const TestImage& image, std::size_t* sent_bytes = nullptr) {
  UpdateSession session(slots);
  const auto free = static_cast<std::size_t>(decide(slots).free);
  wire::BeginUpdate begin = begin_of(image.header[free]);
  if (image.signature[free]) {
    begin.header_bytes = wire::kSignedHeaderBytes;
    const auto block = wire::encode(*image.signature[free]);
    std::copy(block.begin(), block.end(), begin.header.begin() + wire::kImageSignatureAt);
  }
  const auto begun = session.begin(begin);
  if (begun.outcome != UpdateOutcome::done) return begun.outcome;
  while (session.held_bytes() < image.code.size()) {
    wire::UpdateData data;
    data.offset = session.held_bytes();
    data.count = static_cast<std::uint8_t>(
        std::min(wire::UpdateData::kMaxCount, image.code.size() - session.held_bytes()));
    std::copy_n(image.code.begin() + data.offset, data.count, data.data.begin());
    if (sent_bytes != nullptr) *sent_bytes += data.count;
    const auto added = session.add(data);
    if (added.outcome != UpdateOutcome::done) return added.outcome;
  }
  return session.finish().outcome;
}

/// What the bootloader does at a start, and the application when a host confirms it.
inline boot::BootDecision start(MemorySlots& slots) {
  const auto decision = decide(slots);
  if (decision.trial) {
    EXPECT_TRUE(append(slots, {BootEvent::tried, decision.start, inspect(slots, decision.start).tag}));
  } else if (decision.start != ImageSlot::none) {
    boot::record_counter(slots, decision);
  }
  return decision;
}
inline void confirm(MemorySlots& slots, ImageSlot slot) {
  EXPECT_TRUE(append(slots, {BootEvent::confirmed, slot, inspect(slots, slot).tag}));
}

}  // namespace diastole::boot_test
