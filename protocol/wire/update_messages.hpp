#pragma once
// Replacing the firmware over the line: who runs, into the bootloader, the image in pieces, trial and
// confirmation. The layout of these messages never changes and none of them waits for the schema hashes to
// agree, so that any host can replace any firmware.
//
//   host                                   controller
//   ImageQuery (none)                 →                             application
//                                     ←    ImageReport
//   EnterBootloader                   →
//                                     ←    UpdateAnswer             resets
//   open, ImageQuery (a), (b)         →                             bootloader
//                                     ←    ImageReport, ImageReport
//   BeginUpdate                       →
//                                     ←    UpdateAnswer (held)      judges header and signature, erases if need be
//   UpdateData (from held on) …       →
//                                     ←    UpdateAnswer (held) …
//   FinishUpdate                      →
//                                     ←    UpdateAnswer             reads back, verifies
//   StartImage                        →
//                                     ←    UpdateAnswer             resets, tries the new one
//   open, HelloRequest, ImageQuery    →                             new application
//                                     ←    Hello, ImageReport
//   ConfirmImage                      →
//                                     ←    UpdateAnswer

#include <cstddef>
#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/image_signature.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/update.hpp"

namespace diastole::wire {

// clang-format off

// Host → application: reset into the bootloader. Refused unless at rest and disarmed;
// the motor is switched off.
//
// Example EnterBootloader: 09 00
using EnterBootloader = BareRequest<MessageType::EnterBootloader, 9>;

// Host → application or bootloader: what is in a slot? Answered with ImageReport.
//
// Example ImageQuery: 09 00 01
struct ImageQuery {
  DIASTOLE_LAYOUT(ImageQuery,
      (value,   0, uint16_t, request_id),             // chosen by the host; the answer repeats it
      (choice,  2, ImageSlot, slot, kLastImageSlot))  // none: the one that runs
  static constexpr ImageQuery example() { return {.request_id = 9, .slot = ImageSlot::b}; }
};

// Host → application on trial: you work; from now on you are the one to start.
// Repeated, it changes nothing.
//
// Example ConfirmImage: 09 00 88 77 66 55 44 33 22 11
struct ConfirmImage {
  DIASTOLE_LAYOUT(ConfirmImage,
      (value,  0, uint16_t, request_id),  // chosen by the host; the answer repeats it
      (value,  2, uint64_t, build_id))    // of the image that the host means
  static constexpr ConfirmImage example() { return {.request_id = 9, .build_id = 0x1122334455667788}; }
};

// Host → bootloader: an image for the free slot. If the slot holds the beginning of this very image, it is kept
// and the answer says how many bytes of code are there; otherwise the sector is erased, which takes 1 to 2 s. A header
// without a signature is what bootloaders before 1.1.0 take, and those without a key still do.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 allow_older                  1: also one older than the confirmed one
//        3    1 header_bytes                 64, or 136 with the signature
//        4  136 header                       image_header.hpp, image_signature.hpp
//
// Example BeginUpdate: 09 00 00 40 44 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
// 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
// 00 00 00 00 00 00 00 00 8F
struct BeginUpdate {
  static constexpr MessageType kType = MessageType::BeginUpdate;
  std::uint16_t request_id = 0;
  std::uint8_t allow_older = 0;
  std::uint8_t header_bytes = kImageHeaderBytes;
  std::array<std::uint8_t, kSignedHeaderBytes> header{};

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("allow_older", self.allow_older, 0, 1);
    visit.list("header", self.header_bytes, self.header);
  }
  static constexpr BeginUpdate example() {
    BeginUpdate message;
    message.request_id = 9;
    message.header[0] = 0x44;
    message.header[63] = 0x8F;
    return message;
  }
};

// Host → bootloader: the next bytes of code.
//
// Example UpdateData: 09 00 00 01 00 00 04 01 00 00 20
struct UpdateData {
  static constexpr std::size_t kMaxCount = 232;
  DIASTOLE_LAYOUT(UpdateData,
      (value,  0, uint16_t, request_id),             // chosen by the host; the answer repeats it
      (value,  2, uint32_t, offset),                 // from the first byte of code; at most what is held
      (list,   6, count, uint8_t, data, kMaxCount))  // count: of bytes; a multiple of 4
  static constexpr UpdateData example() {
    return {.request_id = 9, .offset = 256, .count = 4, .data = {1, 0, 0, 0x20}};
  }
};

// Host → bootloader: that was all. The image is read back and hashed; if it verifies it is the one to be tried.
//
// Example FinishUpdate: 09 00
using FinishUpdate = BareRequest<MessageType::FinishUpdate, 9>;

// Host → bootloader: reset and start what is to be started.
//
// Example StartImage: 09 00
using StartImage = BareRequest<MessageType::StartImage, 9>;

// Host → bootloader, repeated without pause while the controller is reset by hand: a bootloader that sees one
// within 30 ms of its start stays, whatever the slots hold. Needs no open session.
//
// Example StayInBootloader: 53 54 41 59
struct StayInBootloader {
  static constexpr std::uint32_t kWord = 0x59415453;
  DIASTOLE_LAYOUT(StayInBootloader,
      (within,  0, uint32_t, word, kWord, kWord))  // "STAY"
  static constexpr StayInBootloader example() { return {}; }
};

// Application or bootloader → host. The application knows its own slot only.
//
// Example ImageReport: 09 00 01 01 00 01 00 88 77 66 55 44 33 22 11 30 75 00 00 00 04 00 00 00 00 04
// 08 01
struct ImageReport {
  DIASTOLE_LAYOUT(ImageReport,
      (value,   0, uint16_t, request_id),                   // chosen by the host; the answer repeats it
      (choice,  2, ImageSlot, slot, kLastImageSlot),        // none: the bootloader answers for itself
      (choice,  3, ImageState, standing, kLastImageState),  // update.hpp
      (value,   4, uint8_t, version_major),                 // of the image; 0 if there is no header
      (value,   5, uint8_t, version_minor),
      (value,   6, uint8_t, version_patch),
      (value,   7, uint64_t, build_id),
      (value,  15, uint32_t, code_bytes),
      (value,  19, uint32_t, held_bytes),                   // of code that are there
      (value,  23, uint32_t, link_address),                 // of the slot
      (choice, 27, ImageSlot, free_slot, kLastImageSlot))   // where an update goes
  static constexpr ImageReport example() {
    return {.request_id = 9,
            .slot = ImageSlot::b,
            .standing = ImageState::incomplete,
            .version_minor = 1,
            .build_id = 0x1122334455667788,
            .code_bytes = 30'000,
            .held_bytes = 1024,
            .link_address = 0x0804'0000,
            .free_slot = ImageSlot::b};
  }
};

// Application or bootloader → host: the answer to every request of an update but ImageQuery.
//
// Example UpdateAnswer: 09 00 33 05 00 00 00 00 02 00 00 00
struct UpdateAnswer {
  DIASTOLE_LAYOUT(UpdateAnswer,
      (value,   0, uint16_t, request_id),                        // chosen by the host; the answer repeats it
      (value,   2, uint8_t, request_type),                       // MessageType of the request
      (choice,  3, UpdateOutcome, outcome, kLastUpdateOutcome),  // update_outcome_list.inc
      (value,   4, uint32_t, held_bytes),                        // of code that are there
      (value,   8, uint32_t, value))                             // what the outcome speaks of
  static constexpr UpdateAnswer example() {
    return {.request_id = 9, .request_type = 0x33, .outcome = UpdateOutcome::wrong_board, .value = 2};
  }
};

// clang-format on

}  // namespace diastole::wire
