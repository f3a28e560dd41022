#pragma once
// Slots, and how requests of an update end, as numbered on the wire. The numbers are for ever: a bootloader
// is not replaced by an update.

#include <cstdint>

#include "protocol/wire/last_of.hpp"

namespace diastole::wire {

enum class ImageSlot : std::uint8_t { a = 0, b = 1, none = 2 };
inline constexpr ImageSlot kLastImageSlot = ImageSlot::none;

/// What a slot's image is worth.
//
//   empty ──BeginUpdate──▶ incomplete ──FinishUpdate──▶ installed ──next start──▶ on_trial ──Confirm──▶ confirmed
//                              ▲                                                     │ any reset
//                              └──────────────── BeginUpdate ─────────── failed ◀────┘
enum class ImageState : std::uint8_t {
  empty = 0,       ///< erased, or remains without a header
  incomplete = 1,  ///< a header, but the code does not match it (yet); never started
  installed = 2,   ///< verified; the next start tries it once
  on_trial = 3,    ///< started and not yet confirmed: a reset now returns to the confirmed one
  confirmed = 4,   ///< a host has seen it work
  failed = 5,      ///< was on trial and not confirmed
  unrecorded = 6,  ///< verified, but nobody knows whether it works: written past the bootloader
  refused =
      7,  ///< whole, but not signed with the bootloader's key, or below its rollback counter; never started
};
inline constexpr ImageState kLastImageState = ImageState::refused;

#define DIASTOLE_UPDATE_OUTCOME(number, name, explanation, remedy) name = number,
enum class UpdateOutcome : std::uint8_t {
#include "protocol/wire/update_outcome_list.inc"
};
#define DIASTOLE_UPDATE_OUTCOME(number, name, explanation, remedy) UpdateOutcome::name,
inline constexpr UpdateOutcome kLastUpdateOutcome = last_of({
#include "protocol/wire/update_outcome_list.inc"
});

}  // namespace diastole::wire
