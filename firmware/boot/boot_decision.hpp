#pragma once
// Which image to start: a pure function of the records and of which slots verify. The whole of
// test - confirm - revert, of what survives a power cut, and of what is never started is here.
//
//   1. an image that was installed and never started: once, on trial, after a record that it was tried
//   2. the image confirmed last
//   3. one that no record speaks of (it came past the bootloader, or the records are gone)
//   4. one that was tried and not confirmed: only if there is no other at all
//   5. none: the bootloader stays
//
// A slot whose erase was begun and not ended counts as empty, whatever it reads, if the other one verifies. Only verified
// images count. An update always goes to the slot that 2 to 4 would not start, so a working
// image is never overwritten by one that has not proved itself. What is refused for its signature counts as not verified.

#include <array>
#include <cstdint>
#include <span>

#include "firmware/boot/boot_records.hpp"

namespace diastole::boot {

struct SlotFacts {
  bool has_header = false;
  bool verified = false;  ///< the code matches the header's SHA-256, board and link address
  ImageTag tag{};         ///< of the header
  bool refused = false;   ///< whole, but nobody vouches for it (slot_store.hpp); then not `verified`
};

struct BootDecision {
  wire::ImageSlot start = wire::ImageSlot::none;
  bool trial = false;
  wire::ImageSlot keep = wire::ImageSlot::none;  ///< what is started if not on trial
  wire::ImageSlot free = wire::ImageSlot::a;     ///< where an update goes
  std::array<wire::ImageState, 2> state{};
};

BootDecision decide(std::span<const std::uint8_t> records, const std::array<SlotFacts, 2>& slots);

}  // namespace diastole::boot
